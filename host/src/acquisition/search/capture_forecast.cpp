// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/capture_forecast.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::acquisition {
namespace {

/// Combs that show light of a few pixels' range, or the children of the whole grid.
constexpr double kFewestMore = 4;

/// I² of the channel that has most.
double light_between_pixels(const SceneFacts& facts, Checks& checks, const KnownTransport& nothing) {
  const std::vector<double> dark = Checks::misfit_of_half(checks.residuals(nothing));
  double most = 0;
  for (std::size_t channel = 0; channel < dark.size(); ++channel)
    if (facts.flood_squared[channel] > 0)
      most = std::max(most, 4 * dark[channel] / facts.flood_squared[channel]);  // half of the pixels are lit
  return most;
}

/// Of the whole capture, without budgets.
double photographs_needed(const SceneFacts& facts, double light_squared) {
  const auto pixels = static_cast<double>(facts.tree.grid().size());
  return 3.7 * std::pow(pixels, 1.0 / 4) * std::pow(light_squared / facts.tolerance(), 1.0 / 6);
}

}  // namespace

CaptureForecast forecast_capture(const SceneFacts& facts, Checks& checks, const KnownTransport& nothing,
                                 const SpentBefore& spent) {
  const CaptureSettings& options = facts.options;
  const auto taken = static_cast<double>(spent.photographs);
  const auto brute_force = static_cast<double>(facts.tree.grid().size());
  const double light_squared = light_between_pixels(facts, checks, nothing);
  const double least = light_squared > 0 ? taken + kFewestMore : taken;
  double all = std::clamp(photographs_needed(facts, light_squared), least, std::max(least, brute_force));
  if (options.max_patterns > 0) all = std::min(all, static_cast<double>(options.max_patterns));
  double seconds = spent.rig_seconds + (all - taken) * spent.seconds_each;
  if (options.max_seconds > 0 && seconds > options.max_seconds) {
    seconds = options.max_seconds;
    if (spent.seconds_each > 0) all = taken + std::max(0.0, seconds - spent.rig_seconds) / spent.seconds_each;
  }
  return {std::llround(all), seconds};
}

}  // namespace symrig::acquisition
