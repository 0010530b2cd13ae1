// SPDX-License-Identifier: Apache-2.0
#include "rig/exposure_choice.hpp"

#include "rig/shutter_timing.hpp"
#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr double kShareOfBlack = 1.0 / 16;  // share of the photographs' noise
// [ns] The host merges 300 million samples a second (docs/research/kernels.md).
constexpr double kMerging = 1e9 / 300e6;

Nanoseconds frame_cost(const RigOptions& options, const Camera& camera) {
  if (options.frame_cost) return *options.frame_cost;
  const double samples = static_cast<double>(camera.grid().size()) * camera.channels();
  // A further exposure may be too short to overlap a readout.
  return rig::gap_without_overlap(options) + Nanoseconds{std::llround(kMerging * samples)};
}

Nanoseconds least_exposure(const RigOptions& options, const CameraTiming& timing) {
  return std::max(timing.min_exposure, options.setup.camera.min_exposure);
}

}  // namespace

ExposureRules exposure_rules(const RigOptions& options, const Camera& camera, const CameraTiming& timing) {
  ExposureRules rules;
  rules.min_exposure = least_exposure(options, timing);
  rules.max_exposure = timing.max_exposure;
  rules.whole_periods = options.setup.projector.light_period;
  rules.each_frame = frame_cost(options, camera);
  rules.headroom = options.headroom;
  return rules;
}

Nanoseconds shortest_exposure(const RigOptions& options, const CameraTiming& timing) {
  const Nanoseconds least = least_exposure(options, timing), whole = options.setup.projector.light_period;
  if (whole.count() == 0) return least;
  return std::max<std::int64_t>(1, (least + whole - Nanoseconds{1}) / whole) * whole;
}

Result<Exposures> in_whole_periods(Exposures exposures, const RigOptions& options) {
  const Nanoseconds whole = options.setup.projector.light_period;
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

Expectation expected_flood_lit(const Radiance& metered) {
  constexpr double kRelative = 0.02, kFloor = 1e-4, kOctaves = 3;
  LightHistogram histogram;
  for (std::size_t i = 0; i < metered.mean.values().size(); ++i)
    if (metered.valid.values()[i] != 0) histogram.add(std::max(0.0F, metered.mean.values()[i]));
  const std::vector<ExpectedLight> lights = histogram.lights();
  Expectation expected;
  if (lights.empty() || !(lights.back().radiance > 0)) return expected;
  const double brightest = lights.back().radiance;
  double part_brightest = 0;
  std::vector<ExpectedPart> parts;
  for (std::size_t k = lights.size(); k-- > 0;) {
    const ExpectedLight& light = lights[k];
    if (parts.empty() || (light.radiance < part_brightest * std::exp2(-kOctaves) &&
                          kRelative * part_brightest > kFloor * brightest)) {
      parts.emplace_back();
      part_brightest = light.radiance;
    }
    parts.back().lights.push_back(light);
  }
  for (ExpectedPart& part : parts) {
    double squares = 0, pixels = 0;
    for (const ExpectedLight& light : part.lights) {
      squares += light.pixels * light.radiance * light.radiance;
      pixels += light.pixels;
    }
    part.noise = kRelative * kRelative * squares / pixels + kFloor * kFloor * brightest * brightest;
  }
  expected.parts = std::move(parts);
  return expected;
}

}  // namespace symrig
