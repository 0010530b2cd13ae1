// SPDX-License-Identifier: Apache-2.0
#include "calibration/bracket_changes.hpp"

#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

/// A sample that both exposures see well: its number, its row, and how far its light is from what the other
/// exposure expects, as a share.
struct LightChange {
  std::size_t at;
  std::size_t row;
  double share;
};

/// The light of a code, and the codes that tell it.
class ClearCodes {
 public:
  ClearCodes(const SensorPhotographs& photographs, const SensorFindings& camera) : camera_(camera) {
    const int largest = (1 << photographs.bits) - 1;
    dark_ = camera.response ? 0 : camera.sensor->noise.pedestal();
    const double full = camera.response ? largest : camera.sensor->noise.saturation_code();
    constexpr double kLow = 0.1, kHigh = 0.85;  // of the range: neither noise nor saturation
    low_ = dark_ + kLow * (full - dark_), high_ = dark_ + kHigh * (full - dark_);
  }
  bool clear(std::uint16_t code) const { return code > low_ && code < high_; }
  double light(std::uint16_t code) const {
    return camera_.response ? static_cast<double>(camera_.response->light[code]) : code - dark_;
  }

 private:
  const SensorFindings& camera_;
  double dark_ = 0, low_ = 0, high_ = 0;
};

std::vector<LightChange> light_changes(const SensorPhotographs& photographs, const ClearCodes& codes,
                                       const Frame& shorter, const Frame& longer, double ratio) {
  const auto width = static_cast<std::size_t>(photographs.grid.cols);
  std::vector<LightChange> all;
  for (std::size_t i = 0; i < shorter.raw.size(); ++i) {
    if (!codes.clear(shorter.raw[i]) || !codes.clear(longer.raw[i])) continue;
    const double expected = ratio * codes.light(shorter.raw[i]);
    all.push_back({i, i / width, codes.light(longer.raw[i]) / expected - 1});
  }
  return all;
}

/// Bands of one gain each: the rms of their gains, and what is left of `all` without them.
struct Bands {
  double rms = 0;
  std::vector<LightChange> left;
};
Bands bands_of(const std::vector<LightChange>& all) {
  Bands bands;
  std::vector<double> shares;
  shares.reserve(all.size());
  for (const LightChange& one : all) shares.push_back(one.share);
  const double usual = median(shares);
  double squares = 0;
  for (std::size_t k = 0; k < all.size();) {
    std::size_t end = k;
    std::vector<double> row;
    for (; end < all.size() && all[end].row == all[k].row; ++end) row.push_back(all[end].share);
    const double gain = median(row);
    squares += (gain - usual) * (gain - usual) * static_cast<double>(row.size());
    for (; k < end; ++k) bands.left.push_back({all[k].at, all[k].row, all[k].share - gain});
  }
  bands.rms = std::sqrt(squares / static_cast<double>(all.size()));
  return bands;
}

/// The spread of most samples, and those that differ by a tenth of their light and by more than noise. Noise
/// is 3 % at most where codes are clear; a wider spread is none.
struct LightScatter {
  double sigma = 0;
  std::vector<std::size_t> changed;  ///< samples
  double share_changed = 0;
};
LightScatter light_scatter(const std::vector<LightChange>& all) {
  constexpr double kSigmas = 6, kTenth = 0.1, kMostNoise = 0.03;
  std::vector<double> shares;
  shares.reserve(all.size());
  for (const LightChange& one : all) shares.push_back(one.share);
  const double usual = median(shares);
  LightScatter spread;
  spread.sigma = robust_sigma(shares);
  const double least = kSigmas * std::min(spread.sigma, kMostNoise) + kTenth;
  for (const LightChange& one : all)
    if (std::abs(one.share - usual) > least) spread.changed.push_back(one.at);
  spread.share_changed = static_cast<double>(spread.changed.size()) / static_cast<double>(all.size());
  return spread;
}

}  // namespace

std::vector<BracketChange> find_bracket_changes(const SensorPhotographs& photographs,
                                                std::span<const Frame> frames, const MergedBracket& merged) {
  constexpr std::size_t kFewest = 200;
  constexpr double kBands = 0.03, kPart = 0.01, kMostPart = 0.3;
  const ClearCodes codes(photographs, merged.camera);
  std::vector<BracketChange> found;
  for (const ExposureRatio& ratio : merged.ratios) {
    const std::vector<LightChange> all =
        light_changes(photographs, codes, frames[ratio.shorter], frames[ratio.longer], ratio.seen);
    if (all.size() < kFewest) continue;
    const std::string &longer = photographs.bracket[ratio.longer].file,
                      &shorter = photographs.bracket[ratio.shorter].file;
    const Bands bands = bands_of(all);
    LightScatter spread = light_scatter(all);
    const LightScatter left = light_scatter(bands.left);
    if (bands.rms > std::max(kBands, left.sigma) && left.share_changed <= kPart)
      found.push_back({.what = fmt::format("{} and {} differ in bands, by {:.0f} % rms from row to row: the "
                                           "light flickers (rolling shutter)",
                                           longer, shorter, 100 * bands.rms),
                       .everywhere = true,
                       .values = {}});
    else if (spread.share_changed > kPart && !ratio.wrong())  // a wrong ratio has told already
      found.push_back({.what = fmt::format("{:.0f} % of the pixels have another light in {} than in {}: "
                                           "something has moved or changed there",
                                           100 * spread.share_changed, longer, shorter),
                       .everywhere = spread.share_changed > kMostPart,
                       .values = std::move(spread.changed)});
  }
  return found;
}

}  // namespace symrig::calibration
