// SPDX-License-Identifier: Apache-2.0
#include "calibration/sequence/sequence_light.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// The range of a pixel's values without the extreme ones.
float range_of(const CodePhotographs& photographs, const std::optional<int>& held_out, std::size_t pixel) {
  std::array<float, 2> low{1e30F, 1e30F}, high{-1e30F, -1e30F};  // the two smallest, the two largest
  for (int k = 0; k < photographs.code.photographs(); ++k) {
    if (k / 2 == held_out) continue;
    const float v = photographs.image(k).values()[pixel];
    if (v < low[1]) low[1] = v;
    if (low[1] < low[0]) std::swap(low[0], low[1]);
    if (v > high[1]) high[1] = v;
    if (high[1] > high[0]) std::swap(high[0], high[1]);
  }
  return high[1] - low[1];
}

}  // namespace

ClearPixels find_clear_pixels(const CodePhotographs& photographs, const std::optional<int>& held_out) {
  constexpr std::size_t kMost = 8'000;
  constexpr double kBright = 0.95;
  constexpr float kClear = 0.25F;
  const Grid grid = photographs.camera();
  const int stride = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(grid.size()) / (4 * kMost))));
  std::vector<std::size_t> candidates;
  std::vector<float> ranges;
  for (int r = 0; r < grid.rows - ClearPixels::kNext; r += stride)
    for (int c = 0; c < grid.cols - ClearPixels::kNext; c += stride) {
      candidates.push_back(static_cast<std::size_t>(r) * static_cast<std::size_t>(grid.cols) +
                           static_cast<std::size_t>(c));
      ranges.push_back(range_of(photographs, held_out, candidates.back()));
    }
  const float least = kClear * quantile(std::vector<float>(ranges), kBright);
  ClearPixels clear;
  double squares = 0;
  const auto all =
      static_cast<std::size_t>(std::ranges::count_if(ranges, [&](float v) { return v > least; }));
  const std::size_t each = all / kMost + 1;
  std::size_t seen = 0;
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    if (!(ranges[k] > least) || seen++ % each != 0) continue;
    clear.at.push_back(candidates[k]);
    squares += std::pow(static_cast<double>(ranges[k]), 2);
  }
  if (!clear.at.empty()) clear.contrast = std::sqrt(squares / static_cast<double>(clear.at.size()));
  return clear;
}

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

float SequenceLight::clear_difference(std::size_t pixel) const {
  constexpr float kShare = 0.3F;
  constexpr double kSigmas = 3;
  return std::max(kShare * amplitude.values()[pixel], static_cast<float>(kSigmas * difference_sigma(pixel)));
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
