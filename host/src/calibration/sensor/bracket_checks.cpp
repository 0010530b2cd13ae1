// SPDX-License-Identifier: Apache-2.0
#include "calibration/sensor/bracket_checks.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/hdr/internal/clipping.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

using Still = SensorPhotographs::Still;

constexpr double kLonger = 1.5;
constexpr double kFewestPixels = 100;  // pixels

/// How a longer exposure differs from a shorter one, in numbers of samples.
struct Difference {
  double brighter = 0, darker = 0;
  double middle = 0;  ///< samples of middle tones, which a longer exposure must change
  double middle_changed = 0;

  double changed() const { return brighter + darker; }
  bool is_darker() const { return changed() >= kFewestPixels && darker > brighter; }
  bool is_equal() const {
    constexpr double kMostChanged = 0.05;
    return middle >= kFewestPixels && middle_changed < kMostChanged * middle;
  }
};

/// What noise does not explain counts: two codes, and 3 % of the brightest code.
Difference compare(const Still& shorter, const Still& longer) {
  constexpr double kNoise = 0.03, kDark = 0.1, kBright = 0.6;
  const double top = std::max(hdr::brightest(shorter.codes), hdr::brightest(longer.codes));
  const double least = std::max(2.0, kNoise * top);
  Difference found;
  for (std::size_t i = 0; i < shorter.codes.size(); ++i) {
    const double change = static_cast<double>(longer.codes[i]) - shorter.codes[i];
    found.brighter += change > least ? 1 : 0;
    found.darker += change < -least ? 1 : 0;
    if (shorter.codes[i] < kDark * top || shorter.codes[i] > kBright * top) continue;
    found.middle += 1;
    found.middle_changed += std::abs(change) > least ? 1 : 0;
  }
  return found;
}

std::string name_of(const Still& still) {
  return fmt::format("{} ({:.4g} ms)", still.file, 1e3 * seconds(still.exposure));
}

/// The first still of each exposure, each at least kLonger times as long as the one before.
std::vector<const Still*> ladder_of(const SensorPhotographs& photographs) {
  std::vector<const Still*> sorted, ladder;
  for (const Still& still : photographs.bracket) sorted.push_back(&still);
  std::ranges::stable_sort(sorted, {}, [](const Still* one) { return one->exposure; });
  for (const Still* one : sorted)
    if (ladder.empty() || seconds(one->exposure) >= kLonger * seconds(ladder.back()->exposure))
      ladder.push_back(one);
  return ladder;
}

/// Whether each frame from the second one on shows the exposure of the one before: they grow, and the first
/// one, which belongs to what was before, is no shorter one.
bool is_late(const std::vector<const Still*>& ladder) {
  if (ladder.size() < 3) return false;
  for (std::size_t k = 2; k < ladder.size(); ++k)
    if (compare(*ladder[k - 1], *ladder[k]).is_darker()) return false;
  return compare(*ladder[0], *ladder[1]).is_darker();
}

Error longer_is_darker(const std::vector<const Still*>& ladder, std::size_t at, const Difference& by,
                       bool all) {
  const std::string seen =
      fmt::format("{} is darker than {} in {:.0f} % of the values that differ", name_of(*ladder[at + 1]),
                  name_of(*ladder[at]), 100 * by.darker / by.changed());
  const std::string late =
      at == 0 && is_late(ladder)
          ? "the frames are one late, since all others grow with their exposure (the first one is of another "
            "bracket)"
          : "";
  const std::string order = all            ? "the exposures are in the reverse order"
                            : late.empty() ? "exposures are exchanged, or the light has changed"
                                           : late + ", or exposures are exchanged, or the light has changed";
  return {ErrorCode::bad_value, seen + ": " + order,
          "correct the exposures in capture.toml, or photograph the bracket again"};
}

/// A camera gives no two frames of the same codes: read noise changes some of them.
bool are_the_same(const Still& one, const Still& other) {
  return one.codes == other.codes;
}

Error both_are_equal(const Still& shorter, const Still& longer) {
  if (are_the_same(shorter, longer))
    return {
        ErrorCode::bad_value,
        fmt::format("{} and {} are the same frame, code for code: one was doubled, and another is missing",
                    name_of(longer), name_of(shorter)),
        "photograph the bracket again"};
  return {
      ErrorCode::bad_value,
      fmt::format("{} is as bright as {}: the camera has not used these exposures (automatic exposure), or "
                  "they are not what capture.toml says",
                  name_of(longer), name_of(shorter)),
      "switch automatic exposure off and photograph the bracket again, or correct the exposures"};
}

}  // namespace

Result<void> check_bracket_order(const SensorPhotographs& photographs) {
  const std::vector<const Still*> ladder = ladder_of(photographs);
  std::vector<Difference> found;
  for (std::size_t k = 1; k < ladder.size(); ++k) found.push_back(compare(*ladder[k - 1], *ladder[k]));
  const auto first = std::ranges::find_if(found, &Difference::is_darker);
  if (first != found.end()) {
    const bool all = std::ranges::all_of(
        found, [](const Difference& one) { return one.is_darker() || one.changed() < kFewestPixels; });
    return longer_is_darker(ladder, static_cast<std::size_t>(first - found.begin()), *first, all);
  }
  const auto same = std::ranges::find_if(found, &Difference::is_equal);
  if (same == found.end()) return {};
  const auto at = static_cast<std::size_t>(same - found.begin());
  return both_are_equal(*ladder[at], *ladder[at + 1]);
}

namespace {

/// A sample that both exposures see well: its number, its row, how far its light is from what the other
/// exposure expects, as a share, and the deviation of that share by the noise of both codes.
struct LightChange {
  std::size_t at;
  std::size_t row;
  double share;
  double sigma;
};

/// The light of a code with its noise, and the codes that tell it.
class ClearCodes {
 public:
  explicit ClearCodes(const MergedBracket& merged)
      : camera_(merged.camera), code_variance_(merged.code_variance) {
    dark_ = camera_.response ? 0 : camera_.sensor->noise.pedestal();
    const double full = merged.saturation;
    constexpr double kLow = 0.1, kHigh = 0.85;  // of the range: neither noise nor saturation
    low_ = dark_ + kLow * (full - dark_), high_ = dark_ + kHigh * (full - dark_);
  }
  bool clear(std::uint16_t code) const { return code > low_ && code < high_; }
  double light(std::uint16_t code) const {
    return camera_.response ? static_cast<double>(camera_.response->light[code]) : code - dark_;
  }
  /// Of the light, relative to it.
  double variance(std::uint16_t code) const {
    const double of = light(code);
    if (!camera_.response) {
      const NoiseModel& noise = camera_.sensor->noise;
      return noise.gain() * noise.gain() * noise.variance(of / noise.gain()) / (of * of);
    }
    const auto& curve = camera_.response->light;
    const std::size_t below = std::max(code, std::uint16_t{2}) - 2U,
                      above = std::min(code + 2UL, curve.size() - 1);
    const double slope = (curve[above] - curve[below]) / static_cast<double>(above - below);
    return slope * slope * code_variance_[code] / (of * of);
  }

 private:
  const SensorFindings& camera_;
  const std::vector<double>& code_variance_;
  double dark_ = 0, low_ = 0, high_ = 0;
};

std::vector<LightChange> light_changes(const SensorPhotographs& photographs, const ClearCodes& codes,
                                       const Frame& shorter, const Frame& longer, double ratio) {
  const auto width = static_cast<std::size_t>(photographs.grid.cols);
  std::vector<LightChange> all;
  for (std::size_t i = 0; i < shorter.raw.size(); ++i) {
    if (!codes.clear(shorter.raw[i]) || !codes.clear(longer.raw[i])) continue;
    const double expected = ratio * codes.light(shorter.raw[i]);
    // A bracket in which much moves shows that as noise; where codes are clear, there is no more than this.
    constexpr double kMostNoise = 0.05;
    const double noise = std::sqrt(codes.variance(shorter.raw[i]) + codes.variance(longer.raw[i]));
    all.push_back({i, i / width, codes.light(longer.raw[i]) / expected - 1, std::min(noise, kMostNoise)});
  }
  return all;
}

/// Bands of one gain each: the rms of their gains, less what noise makes of them, and what is left of `all`
/// without them.
struct Bands {
  double rms = 0;
  std::vector<LightChange> left;
};
Bands bands_of(const std::vector<LightChange>& all) {
  Bands bands;
  std::vector<double> shares;
  shares.reserve(all.size());
  for (const LightChange& one : all) shares.push_back(one.share);
  constexpr double kOfMedian = 1.57;  // its variance, by that of a mean
  const double usual = median(shares);
  double squares = 0;
  for (std::size_t k = 0; k < all.size();) {
    std::size_t end = k;
    std::vector<double> row;
    for (; end < all.size() && all[end].row == all[k].row; ++end) row.push_back(all[end].share);
    const double gain = median(row);
    squares += (gain - usual) * (gain - usual) * static_cast<double>(row.size());
    for (; k < end; ++k) squares -= kOfMedian * all[k].sigma * all[k].sigma / static_cast<double>(row.size());
    for (k = end - row.size(); k < end; ++k)
      bands.left.push_back({all[k].at, all[k].row, all[k].share - gain, all[k].sigma});
  }
  bands.rms = std::sqrt(std::max(0.0, squares) / static_cast<double>(all.size()));
  return bands;
}

/// The spread of most samples, and those that differ by a tenth of their light and by more than noise.
struct LightScatter {
  double sigma = 0;
  std::vector<std::size_t> changed;  ///< samples
  double share_changed = 0;
};
LightScatter light_scatter(const std::vector<LightChange>& all) {
  constexpr double kSigmas = 6, kTenth = 0.1;
  std::vector<double> shares;
  shares.reserve(all.size());
  for (const LightChange& one : all) shares.push_back(one.share);
  const double usual = median(shares);
  LightScatter spread;
  spread.sigma = robust_sigma(shares);
  for (const LightChange& one : all)
    if (std::abs(one.share - usual) > kSigmas * one.sigma + kTenth) spread.changed.push_back(one.at);
  spread.share_changed = static_cast<double>(spread.changed.size()) / static_cast<double>(all.size());
  return spread;
}

}  // namespace

std::vector<BracketChange> find_bracket_changes(const SensorPhotographs& photographs,
                                                std::span<const Frame> frames, const MergedBracket& merged) {
  constexpr std::size_t kFewest = 200;
  constexpr double kBands = 0.03, kPart = 0.01, kMostPart = 0.3;
  const ClearCodes codes(merged);
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
