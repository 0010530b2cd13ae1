// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/direct_light.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace symrig::acquisition {

DirectLight::DirectLight(const KnownTransport& known, std::size_t pixels, Model model)
    : entry_(pixels, -1),
      model_(std::move(model)),
      weighted_residual_(model_.least.size() * pixels),
      weight_(model_.least.size() * pixels) {
  const auto scalars = known.scalars();
  for (std::size_t k = 0; k < scalars.size(); ++k)
    if (scalars[k].row == scalars[k].col) entry_[scalars[k].row] = static_cast<std::int32_t>(k);
}

/// What a sample of channel · pixels + pixel may miss, with `share` of all pixels lit.
double DirectLight::variance(std::size_t at, double measured, double share) const {
  const std::size_t channel = at / entry_.size();
  return measured + model_.least[channel] + 4 * share * share * model_.half[channel];
}

void DirectLight::add(std::span<const TreePhotograph> residuals) {
  const std::size_t pixels = entry_.size();
  std::vector<double> lit_share;
  for (const TreePhotograph& photograph : residuals)
    lit_share.push_back(std::accumulate(photograph.pattern.begin(), photograph.pattern.end(), 0.0) /
                        static_cast<double>(pixels));
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, weight_.size(), 4096), [&](const auto& range) {
    for (std::size_t k = 0; k < residuals.size(); ++k) {
      const TreePhotograph& photograph = residuals[k];
      for (std::size_t at = range.begin(); at < range.end(); ++at) {
        const double lit = photograph.pattern[at % pixels];
        if (lit == 0 || photograph.valid[at] == 0) continue;
        const double v = variance(at, static_cast<double>(photograph.variance[at]), lit_share[k]);
        if (v <= 0) continue;
        weighted_residual_[at] += lit * static_cast<double>(photograph.mean[at]) / v;
        weight_[at] += lit * lit / v;
      }
    }
  });
}

void DirectLight::add(const LevelLight& level, const LaterLight& later, const KnownTransport& known) {
  const std::size_t pixels = entry_.size();
  const std::size_t channels = model_.least.size();
  const int child_level = std::min(level.level + 1, later.levels() - 1);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, weight_.size(), 4096), [&](const auto& range) {
    for (std::size_t at = range.begin(); at < range.end(); ++at) {
      const std::size_t t = at % pixels;
      if (entry_[t] < 0 || level.variance[at] < 0) continue;
      const double v =
          variance(at, static_cast<double>(level.variance[at]), static_cast<double>(level.lit_share[t]));
      if (v <= 0) continue;
      const auto direct = static_cast<double>(
          known.scalar_values()[static_cast<std::size_t>(entry_[t]) * channels + at / pixels]);
      const auto within = static_cast<double>(later.within(child_level, at));
      weighted_residual_[at] += (static_cast<double>(level.residual[at]) - direct - within) / v;
      weight_[at] += 1 / v;
    }
  });
}

void DirectLight::apply(KnownTransport& known) const {
  const std::size_t pixels = entry_.size();
  const std::size_t channels = model_.least.size();
  const std::span<float> values = known.change_scalar_values();
  for (std::size_t i = 0; i < pixels; ++i) {
    if (entry_[i] < 0) continue;
    for (std::size_t channel = 0; channel < channels; ++channel) {
      const std::size_t at = channel * pixels + i;
      if (weight_[at] > 0)
        values[static_cast<std::size_t>(entry_[i]) * channels + channel] +=
            static_cast<float>(weighted_residual_[at] / weight_[at]);
    }
  }
}

}  // namespace symrig::acquisition
