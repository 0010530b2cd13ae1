// SPDX-License-Identifier: Apache-2.0
// A pixel of a straight camera has the codes s = p + x and l = p + r x in two exposures whose ratio is r. So
// d = l − r s is (1 − r) p whatever its light is, and its variance is V(l) + r² V(s). Pixels are sorted into
// bins of their light, by a mean of both codes whose noise is independent of d. The mean of d over a bin
// tells the pedestal p, and its spread the noise. The camera is straight if one p fits all bins of all pairs.
#include "hdr/straight_camera.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

namespace symrig::hdr {
namespace {

constexpr double kOff = 0.01;        // of the light: what a straight camera may depart by
constexpr double kSigmas = 4;        // of noise
constexpr double kLeastRatio = 1.2;  // of exposures
constexpr double kMostRatio = 20;
constexpr double kBinsOfTwice = 2;        // bins for each factor of two in light
constexpr std::size_t kFewestInBin = 64;  // pixels of a bin
constexpr std::size_t kPixels = 400'000;  // looked at
constexpr double kLeastRange = 1.8;       // of the light of pixels
constexpr double kLeastCodes = 11;        // the brightest code by the darkest, above the pedestal
constexpr double kFewestCodes = 6;        // above the pedestal, in the shorter exposure
constexpr double kRounding = 1.0 / 12;    // [DN²]
constexpr int kFits = 4;

/// The codes of a straight camera, as far as known: V(code) = dark + slope · (code − pedestal).
struct Line {
  double pedestal = 0, dark = 1, slope = 0;

  double variance(double light) const { return dark + slope * std::max(0.0, light); }
  /// The least light whose noise leaves it above a code, and whose rounding does not hide it.
  double least_light(int low) const {
    const double above = low - pedestal;
    const double square = slope * slope * kSigmas * kSigmas / 4 + dark + slope * above;
    const double reach = square > 0 ? kSigmas * (kSigmas * slope / 2 + std::sqrt(square)) : 0;
    return std::max(kFewestCodes, above + reach);
  }
};

/// Pixels of one light in two exposures.
struct Bin {
  double ratio = 1;         ///< of the exposures
  double light = 0;         ///< mean code above the pedestal in the longer exposure
  double d = 0, sigma = 0;  ///< mean of d, and its standard error
  double variance = 0;      ///< of d
  double pixels = 0;
};

std::size_t stride_of(const Frame& frame) {
  return frame.raw.size() / kPixels | std::size_t{1};
}

/// The mean and the spread of most values: what moves is far out. Rounded codes alone have a spread.
void set_middle(std::vector<double>& values, Bin& bin) {
  constexpr double kOneSigma = 0.1587;
  const double rounding = kRounding * (1 + bin.ratio * bin.ratio);
  const double low = quantile(values, kOneSigma), high = quantile(values, 1 - kOneSigma);
  const double centre = (low + high) / 2;
  const double most = kSigmas * std::max((high - low) / 2, std::sqrt(rounding));
  double sum = 0, squares = 0, count = 0;
  for (const double v : values) {
    if (std::abs(v - centre) > most) continue;
    sum += v - centre;
    squares += (v - centre) * (v - centre);
    ++count;
  }
  bin.d = centre + sum / count;
  bin.variance = std::max(squares / count - (sum / count) * (sum / count), rounding);
  bin.sigma = std::sqrt(bin.variance / count);
  bin.pixels = count;
}

struct Pair {
  const Frame *shorter, *longer;
};

std::vector<Pair> neighbours(std::span<const Frame> frames) {
  std::vector<const Frame*> sorted;
  for (const Frame& frame : frames) sorted.push_back(&frame);
  std::ranges::stable_sort(sorted, {}, [](const Frame* frame) { return frame->exposure; });
  std::vector<Pair> pairs;
  for (std::size_t k = 1; k < sorted.size(); ++k) {
    const double ratio = seconds(sorted[k]->exposure) / seconds(sorted[k - 1]->exposure);
    if (ratio >= kLeastRatio && ratio <= kMostRatio) pairs.push_back({sorted[k - 1], sorted[k]});
  }
  return pairs;
}

void add_bins(const Frame& shorter, const Frame& longer, const UsableCodes& codes, const Line& line,
              std::vector<Bin>& bins) {
  const double r = seconds(longer.exposure) / seconds(shorter.exposure);
  struct Sorted {
    std::vector<double> d;
    double light = 0;
  };
  std::array<Sorted, 64> sorted;
  const double least = line.least_light(codes.low);
  for (std::size_t i = 0; i < shorter.raw.size(); i += stride_of(shorter)) {
    if (!codes.usable(shorter.raw[i]) || !codes.usable(longer.raw[i])) continue;
    const double s = shorter.raw[i] - line.pedestal, l = longer.raw[i] - line.pedestal;
    const double rough = std::max(0.0, (s + l) / (1 + r));
    const double vs = line.variance(rough), vl = line.variance(r * rough);
    const double x = (s / vs + r * l / vl) / (1 / vs + r * r / vl);
    // Noise must not move a pixel of this light past an end of the usable codes.
    if (x < least) continue;
    if (line.pedestal + r * x + kSigmas * std::sqrt(vl) >= codes.high) continue;
    Sorted& into = sorted[static_cast<std::size_t>(
        std::clamp(kBinsOfTwice * std::log2(x / least), 0.0, static_cast<double>(sorted.size() - 1)))];
    into.d.push_back(l - r * s);
    into.light += r * x;
  }
  for (Sorted& one : sorted) {
    if (one.d.size() < kFewestInBin) continue;
    Bin bin{.ratio = r, .light = one.light / static_cast<double>(one.d.size())};
    set_middle(one.d, bin);
    bin.d += (1 - r) * line.pedestal;  // of codes, not of codes above the pedestal
    bins.push_back(bin);
  }
}

/// The pedestal that fits best, and the noise.
Line fit_line(const std::vector<Bin>& bins) {
  Line line;
  double sum = 0, weights = 0;
  Eigen::Matrix2d a = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  for (const Bin& bin : bins) {
    const double off = kOff * bin.light / 2, by = 1 - bin.ratio;
    const double w = 1 / (bin.sigma * bin.sigma + off * off);
    sum += w * by * bin.d;
    weights += w * by * by;
    // Var d = dark (1 + r²) + slope · light (1 + r), to a relative error that the number of pixels tells.
    const Eigen::Vector2d of(1 + bin.ratio * bin.ratio, bin.light * (1 + bin.ratio));
    const double known = bin.pixels / (bin.variance * bin.variance);
    a += known * of * of.transpose();
    b += known * bin.variance * of;
  }
  line.pedestal = std::max(0.0, sum / weights);
  const Eigen::Vector2d both = a.ldlt().solve(b);
  line.dark = both(0), line.slope = both(1);
  if (!(both(0) > kRounding)) line.dark = kRounding, line.slope = (b(1) - kRounding * a(0, 1)) / a(1, 1);
  if (!(line.slope > 0)) line.dark = std::max(kRounding, b(0) / a(0, 0)), line.slope = 0;
  return line;
}

bool fits(const Line& line, const std::vector<Bin>& bins) {
  double least = bins.front().light, most = least, darkest = least;
  for (const Bin& bin : bins) {
    const double off = std::abs(bin.d - (1 - bin.ratio) * line.pedestal);
    if (off > kSigmas * bin.sigma + kOff * bin.light) return false;
    least = std::min(least, bin.light), most = std::max(most, bin.light);
    darkest = std::min(darkest, bin.light / bin.ratio);
  }
  return most >= kLeastRange * least && most >= kLeastCodes * darkest;
}

/// Whether pixels that the shorter exposure expects beyond the usable codes are there. If not, the camera
/// clips lower than is known.
bool clips_lower(const Frame& shorter, const Frame& longer, const UsableCodes& codes, const Line& line) {
  constexpr double kMost = 0.01;
  const double r = seconds(longer.exposure) / seconds(shorter.exposure);
  double beyond = 0, below = 0;
  for (std::size_t i = 0; i < shorter.raw.size(); i += stride_of(shorter)) {
    const double light = shorter.raw[i] - line.pedestal;
    const double sigma = r * std::sqrt(line.variance(light)) + std::sqrt(line.variance(r * light));
    if (!codes.usable(shorter.raw[i]) || line.pedestal + r * light - kSigmas * sigma < codes.high) continue;
    beyond += 1;
    below += codes.usable(longer.raw[i]) ? 1 : 0;
  }
  return beyond >= static_cast<double>(kFewestInBin) && below > kMost * beyond;
}

}  // namespace

std::optional<NoiseModel> straight_camera(std::span<const Frame> frames, const UsableCodes& codes) {
  const std::vector<Pair> pairs = neighbours(frames);
  Line line;
  std::vector<Bin> bins;
  for (int round = 0; round < kFits; ++round) {
    bins.clear();
    for (const auto& [shorter, longer] : pairs) add_bins(*shorter, *longer, codes, line, bins);
    if (bins.empty()) return {};
    line = fit_line(bins);
  }
  const bool clips = std::ranges::any_of(
      pairs, [&](const Pair& pair) { return clips_lower(*pair.shorter, *pair.longer, codes, line); });
  if (clips || !fits(line, bins)) return {};
  constexpr double kLeastSlope = 1e-6;  // [DN]; a camera without noise of light
  int bits = 1;
  while (1 << bits < codes.codes) ++bits;
  const NoiseModel model =
      NoiseModel::from_variance_line({line.dark, std::max(line.slope, kLeastSlope), bits, line.pedestal});
  const double margin = 5 * model.gain() * model.read_noise();  // that NoiseModel leaves below clipping
  return model.clipped_at(static_cast<int>(std::ceil(codes.high + margin)));
}

}  // namespace symrig::hdr
