// SPDX-License-Identifier: Apache-2.0
#include "calibration/photograph_noise.hpp"

#include "calibration/scatter_noise.hpp"
#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

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

}  // namespace symrig::calibration
