// SPDX-License-Identifier: Apache-2.0
#include "rig/exposure_choice.hpp"

#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kShareOfBlack = 1.0 / 16;  // share of the photographs' noise

}  // namespace

ExposureRules exposure_rules(const RigOptions& options, const CameraTiming& timing) {
  ExposureRules rules;
  rules.min_exposure = std::max(timing.min_exposure, options.setup.camera.min_exposure);
  rules.max_exposure = timing.max_exposure;
  rules.whole_periods = options.setup.projector.light_period;
  rules.each_frame = options.frame_cost;
  rules.headroom = options.headroom;
  return rules;
}

Nanoseconds shortest_exposure(const RigOptions& options, const CameraTiming& timing) {
  const ExposureRules rules = exposure_rules(options, timing);
  const Nanoseconds whole = rules.whole_periods;
  if (whole.count() == 0) return rules.min_exposure;
  return std::max<std::int64_t>(1, (rules.min_exposure + whole - Nanoseconds{1}) / whole) * whole;
}

Result<Exposures> in_whole_periods(Exposures exposures, const RigOptions& options) {
  const Nanoseconds whole = exposure_rules(options, {}).whole_periods;
  if (whole.count() == 0) return exposures;
  for (Nanoseconds& exposure : exposures) {
    if (exposure < whole)
      return Error{ErrorCode::limit,
                   fmt::format("the scene needs an exposure of {:.3g} ms, but the projector needs {:.4g} ms "
                               "to form its light",
                               1e3 * seconds(exposure), 1e3 * seconds(whole)),
                   "use less light or close the aperture"};
    exposure -= exposure % whole;
  }
  return exposures;
}

double black_level(const std::optional<Radiance>& black) {
  if (!black) return 0;
  std::vector<float> valid;
  for (std::size_t i = 0; i < black->mean.values().size(); ++i)
    if (black->valid.values()[i] != 0) valid.push_back(black->mean.values()[i]);
  if (valid.empty()) return 0;
  const auto size = std::ssize(valid);
  return std::max(0.0, static_cast<double>(ranked(valid, size - 1 - size / 1000)));
}

double mean_variance(const Radiance& photograph) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < photograph.variance.values().size(); ++i) {
    if (photograph.valid.values()[i] == 0) continue;
    sum += static_cast<double>(photograph.variance.values()[i]);
    count += 1;
  }
  return count > 0 ? sum / count : 0;
}

double least_noise(const Expectation& expected) {
  double least = std::numeric_limits<double>::infinity();
  for (const ExpectedPart& part : expected.parts) least = std::min(least, part.noise);
  return least;
}

Expectation expected_black(const Radiance& black, const Expectation& of_photographs, int photographs) {
  LightHistogram lights;
  for (std::size_t i = 0; i < black.mean.values().size(); ++i)
    if (black.valid.values()[i] != 0)
      lights.add(std::max(0.0F, black.mean.values()[i]) + std::sqrt(black.variance.values()[i]));
  Expectation expected;
  expected.parts.push_back({lights.lights(), kShareOfBlack * photographs * least_noise(of_photographs)});
  expected.longest_seconds = of_photographs.longest_seconds / (kShareOfBlack * photographs);
  return expected;
}

}  // namespace symrig
