// SPDX-License-Identifier: Apache-2.0
#include "hdr/sensor_parts.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::hdr {
namespace {

constexpr double kDefectSigmas = 8;  // a defect differs by more: one false alarm in 10^14 pixels
constexpr double kNoisy = 16;        // times the median variance: four times the noise

}  // namespace

void find_hot(const PixelMoments& dark, std::size_t frames, std::span<std::uint8_t> defects) {
  std::vector<double> means = dark.mean, noises = dark.variance;
  const double middle = median(means);
  const double spread = std::max(robust_sigma(dark.mean), 0.3);
  const double noise = std::max(median(noises), 1.0 / 12);
  // A χ² of few degrees of freedom has a long tail: with fewer frames the threshold is higher.
  const double noisy = kNoisy * (1 + 8 / static_cast<double>(frames - 1));
  for (std::size_t i = 0; i < defects.size(); ++i)
    if (std::abs(dark.mean[i] - middle) > kDefectSigmas * spread || dark.variance[i] > noisy * noise)
      defects[i] = 1;
}

double mean_of(std::span<const double> values, std::span<const std::uint8_t> defects) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (defects[i] == 0) {
      sum += values[i];
      count += 1;
    }
  return count > 0 ? sum / count : 0;
}

double rms_beyond(double squares, double count, double noise) {
  return count > 0 ? std::sqrt(std::max(0.0, squares / count - noise)) : 0;
}

double dsnu_of(const PixelMoments& dark, std::span<const std::uint8_t> defects, std::size_t frames) {
  double sum = 0, squares = 0, noise = 0, count = 0;
  for (std::size_t i = 0; i < dark.mean.size(); ++i) {
    if (defects[i] != 0) continue;
    sum += dark.mean[i];
    squares += dark.mean[i] * dark.mean[i];
    noise += dark.variance[i] / static_cast<double>(frames);
    count += 1;
  }
  if (count < 2) return 0;
  return rms_beyond(squares - sum * sum / count, count - 1, noise / count);
}

void set_noise(Sensor& sensor, const TransferLine& line, int bits, double pedestal, int clipping) {
  sensor.noise = NoiseModel::from_variance_line({line.offset, line.slope, bits, pedestal});
  if (clipping < (1 << bits) - 1) sensor.noise = sensor.noise.clipped_at(clipping);
  sensor.gain_sigma = std::sqrt(line.slope_variance) / line.slope;
  const double read = std::max(line.offset - 1.0 / 12, 1.0 / 12);
  sensor.read_noise_sigma = std::hypot(std::sqrt(line.offset_variance) / (2 * read), sensor.gain_sigma);
}

}  // namespace symrig::hdr
