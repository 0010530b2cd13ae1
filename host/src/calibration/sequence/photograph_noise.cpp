// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/photograph_noise.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

namespace symrig::calibration {
namespace {

constexpr std::size_t kBins = 8;

/// Mean square of the values within three robust sigmas of 0. The median alone would be quantised as coarsely
/// as 8-bit codes. If noise is smaller than a code, half of the values may be 0. Then a difference of one or
/// two codes is not far. step: of the codes.
double robust_square(const std::vector<double>& values, double step) {
  const double limit = std::max(3 * robust_sigma(values, 0), 2.5 * step);
  double sum = 0, count = 0;
  for (const double v : values) {
    sum += std::abs(v) <= limit ? v * v : 0;
    count += std::abs(v) <= limit ? 1 : 0;
  }
  return count == 0 ? 0 : sum / count;
}

/// The distance from one code to the next: the least distance of two values. Negligible for radiance. 0 if it
/// is larger than that of 8-bit codes: then a picture has too few values to tell.
double code_step(const CodePhotographs& photographs) {
  const auto white = photographs.white().values();
  std::vector<float> values;
  for (std::size_t i = 0; i < white.size(); i += white.size() / 20'000 + 1) values.push_back(white[i]);
  std::ranges::sort(values);
  float step = 1;
  for (std::size_t i = 0; i + 1 < values.size(); ++i)
    if (values[i + 1] > values[i]) step = std::min(step, values[i + 1] - values[i]);
  constexpr float kLargest = 1.01F / 255;
  return step < kLargest ? static_cast<double>(step) : 0;
}

/// No photograph is better than its rounding to codes.
NoiseLine with_rounding(NoiseLine line, const CodePhotographs& photographs) {
  const double rounding = std::pow(code_step(photographs), 2) / 12;
  line.constant = std::max(line.constant, rounding);
  line.rms = std::max(line.rms, std::sqrt(rounding));
  return line;
}

/// A sample of the pixels, darkest first.
std::vector<std::size_t> sample_by_level(const CodePhotographs& photographs) {
  const auto white = photographs.white().values();
  const std::size_t stride = std::max<std::size_t>(1, white.size() / 20'000) | 1U;
  std::vector<std::size_t> sample;
  for (std::size_t i = 0; i < white.size(); i += stride) sample.push_back(i);
  std::ranges::stable_sort(sample, {}, [&](std::size_t i) { return white[i]; });
  return sample;
}

class PairSums {
 public:
  PairSums(const CodePhotographs& photographs, const std::vector<std::size_t>& sample,
           const std::optional<int>& held_out)
      : photographs_(photographs), sample_(sample), step_(code_step(photographs)) {
    for (int pair = 0; pair < photographs.code.pairs(); ++pair) {
      if (pair == held_out) continue;
      std::vector<double> sums;
      sums.reserve(sample.size());
      for (const std::size_t i : sample) sums.push_back(sum(pair, i));
      off_.push_back(sums);
      const double middle = median(sums);
      for (double& off : off_.back()) off -= middle;
    }
  }

  NoisePoint bin(std::size_t begin, std::size_t end) const {
    std::vector<double> deviations;
    NoisePoint point;
    for (std::size_t at = begin; at < end; ++at)
      point.level += level(sample_[at]) / static_cast<double>(end - begin);
    for (const auto& off : off_)
      for (std::size_t at = begin; at < end; ++at) deviations.push_back(off[at]);
    point.variance = robust_square(deviations, step_) / 4;
    return point;
  }

 private:
  double sum(int pair, std::size_t i) const {
    return static_cast<double>(photographs_.image(2 * pair).values()[i] +
                               photographs_.image(2 * pair + 1).values()[i] -
                               photographs_.white().values()[i] - photographs_.black().values()[i]);
  }
  double level(std::size_t i) const {
    return static_cast<double>(photographs_.white().values()[i] + photographs_.black().values()[i]) / 2;
  }

  const CodePhotographs& photographs_;
  const std::vector<std::size_t>& sample_;
  double step_;
  std::vector<std::vector<double>> off_;  ///< of each pair: sums minus their median, in the sample's order
};

/// Derived complements: 2 pattern − white − black.
NoiseLine of_derived(NoiseLine line) {
  line.in_difference = 6;
  line.between_pairs = 1.0 / 3;
  return line;
}

}  // namespace

NoiseLine line_through(const std::vector<NoisePoint>& points) {
  double n = 0, x = 0, xx = 0, y = 0, xy = 0;
  for (const NoisePoint& p : points) {
    if (!(p.variance > 0)) continue;
    const double w = 1 / (p.variance * p.variance);
    n += w, x += w * p.level, xx += w * p.level * p.level, y += w * p.variance,
        xy += w * p.level * p.variance;
  }
  if (!(n > 0)) return {};
  const double det = n * xx - x * x;
  NoiseLine line;
  line.slope = det > 1e-9 * n * xx ? (n * xy - x * y) / det : 0;
  line.constant = (y - line.slope * x) / n;
  if (line.slope < 0) line.constant = y / n, line.slope = 0;
  if (line.constant < 0) line.constant = 0, line.slope = xy / xx;
  return line;
}

NoiseLine estimate_noise(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  if (complements_are_derived(photographs, held_out))
    return with_rounding(of_derived(estimate_scatter_noise(photographs, held_out)), photographs);
  const auto sample = sample_by_level(photographs);
  const PairSums sums(photographs, sample, held_out);
  std::vector<NoisePoint> points;
  for (std::size_t bin = 0; bin < kBins; ++bin)
    points.push_back(sums.bin(bin * sample.size() / kBins, (bin + 1) * sample.size() / kBins));
  NoiseLine line = line_through(points);
  for (const NoisePoint& p : points) line.rms += p.variance / kBins;
  line.rms = std::sqrt(line.rms);
  return with_rounding(line, photographs);
}

NoiseLine estimate_repeat_noise(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  if (complements_are_derived(photographs, held_out))
    return with_rounding(of_derived(estimate_scatter_noise(photographs, held_out)), photographs);
  const auto sample = sample_by_level(photographs);
  std::vector<int> pairs;
  for (int pair = 0; pair < photographs.code.pairs(); ++pair)
    if (pair != held_out) pairs.push_back(pair);
  const auto sum = [&](int pair, std::size_t i) {
    return static_cast<double>(photographs.image(2 * pair).values()[i]) +
           static_cast<double>(photographs.image(2 * pair + 1).values()[i]);
  };
  const double step = code_step(photographs);
  std::vector<NoisePoint> points;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    std::vector<double> changes;
    NoisePoint point;
    double count = 0;
    for (std::size_t at = bin * sample.size() / kBins; at < (bin + 1) * sample.size() / kBins; ++at)
      for (std::size_t k = 0; k + 1 < pairs.size(); ++k) {
        const double here = sum(pairs[k], sample[at]), next = sum(pairs[k + 1], sample[at]);
        changes.push_back(next - here);
        point.level += here / 2, count += 1;
      }
    point.level /= std::max(count, 1.0);
    point.variance = robust_square(changes, step) / 4;
    points.push_back(point);
  }
  return with_rounding(line_through(points), photographs);
}

namespace {

/// White − black of the brightest pixels.
double largest_contrast(const CodePhotographs& photographs) {
  constexpr std::size_t kSample = 20'000;
  const auto white = photographs.white().values(), black = photographs.black().values();
  std::vector<double> contrasts;
  for (std::size_t i = 0; i < white.size(); i += white.size() / kSample + 1)
    contrasts.push_back(static_cast<double>(white[i] - black[i]));
  return ranked(contrasts, std::ssize(contrasts) * 99 / 100);
}

/// Level and variance of one window of two patterns.
struct WindowNoise {
  double level = 0, variance = 0;
};

/// Compares two patterns in windows of 3 × 3 pixels.
class Windows {
 public:
  explicit Windows(const CodePhotographs& photographs)
      : photographs_(photographs), unlit_(kUnlit * largest_contrast(photographs)) {}

  /// Adds the windows of two pairs' patterns; `anywhere`: also where they do not light the surroundings
  /// alike.
  void compare(int pair, int other, bool anywhere, std::vector<WindowNoise>& to) const {
    const Grid grid = photographs_.camera();
    for (int row = kReach; row < grid.rows - kReach; row += kStride)
      for (int col = kReach; col < grid.cols - kReach; col += kStride)
        if (anywhere || alike(pair, other, row, col)) to.push_back(noise_of(pair, other, row, col));
  }

 private:
  static constexpr int kReach = 4, kStride = 4;
  static constexpr int kSize = 9, kUnknowns = 3;
  static constexpr double kClear = 0.3;   // of white − black; as in the order of the stripes
  static constexpr double kUnlit = 0.02;  // of the largest contrast; below, all patterns are alike

  /// Pattern minus complement, which 2 p − white − black is.
  float difference(int pair, int row, int col) const {
    return 2 * photographs_.image(2 * pair).at(row, col) - photographs_.white().at(row, col) -
           photographs_.black().at(row, col);
  }
  /// 1: lit by the pattern, −1: dark in it, 0: it sees an edge, 2: no pattern lights it.
  int state(int pair, int row, int col) const {
    const auto contrast =
        static_cast<double>(photographs_.white().at(row, col) - photographs_.black().at(row, col));
    if (contrast < unlit_) return 2;
    const auto d = static_cast<double>(difference(pair, row, col));
    return d > kClear * contrast ? 1 : d < -kClear * contrast ? -1 : 0;
  }
  /// Whether the same light falls on the surroundings in both patterns.
  bool alike(int pair, int other, int row, int col) const {
    const int here = state(pair, row, col);
    for (const int y : {-kReach, -1, 0, 1, kReach})
      for (const int x : {-kReach, -1, 0, 1, kReach})
        if (here == 0 || state(pair, row + y, col + x) != here || state(other, row + y, col + x) != here)
          return false;
    return true;
  }
  WindowNoise noise_of(int pair, int other, int row, int col) const {
    Eigen::Matrix<double, kSize, kUnknowns> a;
    Eigen::Matrix<double, kSize, 1> y;
    for (int k = 0; k < kSize; ++k) {
      const int down = k / 3 - 1, right = k % 3 - 1;
      const auto q = static_cast<double>(photographs_.image(2 * other).at(row + down, col + right));
      a.row(k) << q, q * right, q * down;
      y[k] = static_cast<double>(photographs_.image(2 * pair).at(row + down, col + right));
    }
    const Eigen::Vector3d gain = a.colPivHouseholderQr().solve(y);
    const double left = (y - a * gain).squaredNorm() / (kSize - kUnknowns);
    return {y.mean(), left / (1 + gain[0] * gain[0])};
  }

  const CodePhotographs& photographs_;
  double unlit_;
};

/// Pairs whose stripes are much wider than a window, as far as the projector is known: the coarsest half of
/// each axis.
std::vector<int> coarse_pairs(const GrayCode& code, const std::optional<int>& held_out) {
  std::vector<int> pairs;
  for (int pair = 0; pair < code.pairs(); ++pair)
    if (pair != held_out && code.pair(pair).bit <= code.bits(code.pair(pair).axis) / 2) pairs.push_back(pair);
  return pairs;
}

/// The median of χ² / degrees of freedom, with six degrees.
constexpr double kMedianOfSix = 5.348 / 6;

}  // namespace

bool complements_are_derived(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  constexpr double kExact = 0.95, kLit = 0.05;
  constexpr float kRounding = 1e-6F;  // of sums of floats
  const auto lit = static_cast<float>(kLit * largest_contrast(photographs));
  const auto white = photographs.white().values(), black = photographs.black().values();
  const std::size_t stride = white.size() / 5'000 + 1;
  std::int64_t all = 0, exact = 0;
  for (int pair = 0; pair < photographs.code.pairs(); ++pair) {
    if (pair == held_out) continue;
    const auto pattern = photographs.image(2 * pair).values(),
               complement = photographs.image(2 * pair + 1).values();
    for (std::size_t i = 0; i < white.size(); i += stride) {
      if (white[i] - black[i] <= lit) continue;
      const float sum = white[i] + black[i];
      all += 1, exact += std::abs(pattern[i] + complement[i] - sum) <= kRounding * sum ? 1 : 0;
    }
  }
  return all > 0 && static_cast<double>(exact) > kExact * static_cast<double>(all);
}

NoiseLine estimate_scatter_noise(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  const std::vector<int> pairs = coarse_pairs(photographs.code, held_out);
  const Windows windows(photographs);
  std::vector<WindowNoise> found;
  for (std::size_t k = 0; k + 1 < pairs.size(); ++k) windows.compare(pairs[k], pairs[k + 1], false, found);
  // Where there is nothing but noise, no light is alike.
  if (found.empty() && pairs.size() > 1) windows.compare(pairs[0], pairs[1], true, found);
  std::ranges::sort(found, {}, &WindowNoise::level);
  constexpr std::size_t kGroups = 8;
  std::vector<NoisePoint> points;
  for (std::size_t bin = 0; bin < kGroups && !found.empty(); ++bin) {
    std::vector<double> variances;
    NoisePoint point;
    const std::size_t begin = bin * found.size() / kGroups, end = (bin + 1) * found.size() / kGroups;
    for (std::size_t at = begin; at < end; ++at) {
      variances.push_back(found[at].variance);
      point.level += found[at].level / static_cast<double>(end - begin);
    }
    if (variances.empty()) continue;
    point.variance = median(variances) / kMedianOfSix;
    points.push_back(point);
  }
  NoiseLine line = line_through(points);
  for (const NoisePoint& p : points) line.rms += p.variance / static_cast<double>(points.size());
  line.rms = std::sqrt(line.rms);
  return line;
}

}  // namespace symrig::calibration
