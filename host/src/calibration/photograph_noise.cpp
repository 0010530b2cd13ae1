// SPDX-License-Identifier: Apache-2.0
#include "calibration/photograph_noise.hpp"

#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::calibration {
namespace {

constexpr std::size_t kBins = 8;

/// Mean square of the values within three robust sigmas of 0. The median alone would be quantised as coarsely
/// as 8-bit codes.
double robust_square(const std::vector<double>& values) {
  const double limit = 3 * robust_sigma(values, 0);
  double sum = 0, count = 0;
  for (const double v : values) {
    sum += std::abs(v) <= limit ? v * v : 0;
    count += std::abs(v) <= limit ? 1 : 0;
  }
  return count == 0 ? 0 : sum / count;
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

/// Level and variance of one bin of the sample.
struct NoisePoint {
  double level = 0, variance = 0;
};

class PairSums {
 public:
  PairSums(const CodePhotographs& photographs, const std::vector<std::size_t>& sample,
           const std::optional<int>& held_out)
      : photographs_(photographs), sample_(sample) {
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
    point.variance = robust_square(deviations) / 4;
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
  std::vector<std::vector<double>> off_;  ///< of each pair: sums minus their median, in the sample's order
};

/// Relative least squares: every bin knows its variance to the same relative error.
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
  if (line.slope < 0) line = {y / n, 0, 0};
  if (line.constant < 0) line = {0, xy / xx, 0};
  return line;
}

}  // namespace

NoiseLine estimate_noise(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  const auto sample = sample_by_level(photographs);
  const PairSums sums(photographs, sample, held_out);
  std::vector<NoisePoint> points;
  for (std::size_t bin = 0; bin < kBins; ++bin)
    points.push_back(sums.bin(bin * sample.size() / kBins, (bin + 1) * sample.size() / kBins));
  NoiseLine line = line_through(points);
  for (const NoisePoint& p : points) line.rms += p.variance / kBins;
  line.rms = std::sqrt(line.rms);
  return line;
}

namespace {

/// Mean square of the values that are not far from 0. In 8-bit photographs half of the pixels may repeat
/// exactly; then a difference of one code is not far.
double repeat_square(std::vector<double>& values) {
  const double robust = robust_square(values);
  if (robust > 0) return robust;
  double code = 1;
  for (const double v : values)
    if (v != 0) code = std::min(code, std::abs(v));
  double sum = 0, count = 0;
  for (const double v : values)
    if (std::abs(v) < 2.5 * code) sum += v * v, count += 1;
  return count > 0 ? sum / count : 0;
}

}  // namespace

NoiseLine estimate_repeat_noise(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  const auto sample = sample_by_level(photographs);
  std::vector<int> pairs;
  for (int pair = 0; pair < photographs.code.pairs(); ++pair)
    if (pair != held_out) pairs.push_back(pair);
  const auto sum = [&](int pair, std::size_t i) {
    return static_cast<double>(photographs.image(2 * pair).values()[i]) +
           static_cast<double>(photographs.image(2 * pair + 1).values()[i]);
  };
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
    point.variance = repeat_square(changes) / 4;
    points.push_back(point);
  }
  return line_through(points);
}

}  // namespace symrig::calibration
