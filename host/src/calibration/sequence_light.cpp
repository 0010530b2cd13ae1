// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence_light.hpp"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

constexpr std::size_t kSample = 20'000;  // lit pixels that are used

/// Whether the patterns differ at a pixel by more than noise. Of derived complements this says more than p −
/// n, which has the noise of white and black in all pairs.
bool patterns_differ(const SequenceLight& light, std::size_t pixel) {
  double sum = 0, squares = 0;
  for (const int pair : light.pairs) {
    const double v = light.of(2 * pair, pixel);
    sum += v, squares += v * v;
  }
  const auto n = static_cast<double>(light.pairs.size());
  constexpr double kSigmas = 8;
  return squares - sum * sum / n > std::pow(light.sigma(pixel), 2) * (n + kSigmas * std::sqrt(2 * n));
}

/// Σ (p − n)² of one row of pixels.
void add_energy(SequenceLight& light, std::size_t begin, std::size_t end) {
  const auto energy = light.amplitude.values();
  for (const int pair : light.pairs)
    for (std::size_t i = begin; i < end; ++i) {
      const float d = light.difference(pair, i);
      energy[i] += d * d;
    }
  const auto n = static_cast<double>(light.pairs.size());
  constexpr double kSigmas = 8;
  for (std::size_t i = begin; i < end; ++i) {
    const double alone =
        std::pow(light.difference_sigma(i), 2) * (n + kSigmas * light.noise.squares_deviation(n));
    const bool lit = static_cast<double>(energy[i]) > alone &&
                     (!light.photographs.complements_derived || patterns_differ(light, i));
    energy[i] = lit ? std::sqrt(energy[i] / static_cast<float>(n)) : 0;
  }
}

}  // namespace

double SequenceLight::sigma(std::size_t pixel) const {
  const double level = pairs.empty() ? 0 : static_cast<double>(sum(pairs.front(), pixel)) / 2;
  return std::sqrt(std::max(noise.variance(std::max(level, 0.0)), 1e-12));
}

double SequenceLight::difference_sigma(std::size_t pixel) const {
  return std::sqrt(noise.in_difference) * sigma(pixel);
}

SequenceLight find_sequence_light(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  SequenceLight light{
      photographs, {}, estimate_repeat_noise(photographs, held_out), Image<float>(photographs.camera()),
      {},          0};
  for (int pair = 0; pair < photographs.code.pairs(); ++pair)
    if (pair != held_out) light.pairs.push_back(pair);
  const Grid grid = photographs.camera();
  const std::size_t width = grid.cols;
  tbb::parallel_for(std::size_t{0}, static_cast<std::size_t>(grid.rows),
                    [&](std::size_t row) { add_energy(light, row * width, (row + 1) * width); });
  const auto amplitude = light.amplitude.values();
  const std::size_t lit = std::ranges::count_if(amplitude, [](float a) { return a > 0; });
  const std::size_t stride = std::max<std::size_t>(1, lit / kSample);
  std::size_t seen = 0;
  double squares = 0;
  for (std::size_t i = 0; i < amplitude.size(); ++i) {
    if (!(amplitude[i] > 0) || seen++ % stride != 0) continue;
    light.sample.push_back(i);
    squares += static_cast<double>(amplitude[i] * amplitude[i]);
  }
  if (!light.sample.empty()) light.contrast = std::sqrt(squares / static_cast<double>(light.sample.size()));
  return light;
}

}  // namespace symrig::calibration
