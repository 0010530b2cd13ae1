// SPDX-License-Identifier: Apache-2.0

#include "rig/exposure_choice.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::rig {

namespace {

constexpr Nanoseconds kRounding{1'000};    // of an exposure and a gap to the board's ticks
constexpr Nanoseconds kLeastGap{100'000};  // between two pulses, so that a camera sees the first one end

}  // namespace

void adopt_timing(RigOptions& options, const CameraTiming& timing) {
  CameraProfile& camera = options.setup.camera;
  const Nanoseconds longer = std::max(Nanoseconds{0}, timing.readout - camera.readout);
  camera.readout += longer;
  if (options.gap) *options.gap += longer;
  camera.trigger_delay = std::max(camera.trigger_delay, timing.trigger_delay);
  if (timing.overlap.count() == 0) return;
  camera.overlap_time_max =
      camera.overlap ? std::max(camera.overlap_time_max, timing.overlap) : timing.overlap;
  camera.overlap = true;
}

Nanoseconds gap_without_overlap(const RigOptions& options) {
  return options.gap.value_or(options.setup.camera.readout);
}

Nanoseconds longest_overlap(const RigOptions& options) {
  const CameraProfile& camera = options.setup.camera;
  if (!camera.overlap) return Nanoseconds{0};
  const Nanoseconds gap = gap_without_overlap(options);
  const Nanoseconds until_ready = camera.overlap_time_max + gap - camera.readout;
  return std::max(Nanoseconds{0}, std::min(gap - kLeastGap, until_ready));
}

Nanoseconds overlap_before(Nanoseconds exposure, Nanoseconds longest) {
  return std::clamp(exposure - kRounding, Nanoseconds{0}, longest);
}

}  // namespace symrig::rig

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
  expected.most_seconds = of_photographs.black_seconds / photographs;
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

std::optional<double> brightest_rate(const FrameReading& reading, std::span<const CameraFrame> frames,
                                     std::span<const Nanoseconds> exposures, const Camera& camera,
                                     double scale) {
  std::optional<double> rate;
  for (std::size_t i = 0; i < frames.size(); ++i)
    if (const auto one = reading.brightest_rate(frames[i], exposures[i], camera, scale)) rate = one;
  return rate;
}

Nanoseconds exposure_for(double rate, double headroom, const NoiseModel& noise) {
  const double electrons = (noise.saturation_code() - noise.pedestal()) / noise.gain();
  const double longest = 3600;  // limit in seconds: a black scene would ask for an infinite exposure
  const double t = rate > 0 ? std::min(longest, electrons / (headroom * rate)) : longest;
  return Nanoseconds(static_cast<std::int64_t>(1e9 * t));
}

Result<std::vector<Nanoseconds>> plan_exposures(Nanoseconds wanted, int count, double ratio,
                                                const CameraTiming& timing) {
  const double span = std::pow(ratio, count - 1);
  const double base = std::min(1e9 * seconds(wanted), 1e9 * seconds(timing.max_exposure) / span);
  if (base < static_cast<double>(timing.min_exposure.count()))
    return Error{
        ErrorCode::limit,
        fmt::format("a bracket of {} exposures at ratio {} would begin at {:.3g} ms; the camera allows "
                    "{:.3g} ms to {:.3g} s",
                    count, ratio, 1e-6 * base, 1e3 * seconds(timing.min_exposure),
                    seconds(timing.max_exposure)),
        "use fewer exposures, a smaller ratio, or less light"};
  std::vector<Nanoseconds> exposures;
  exposures.reserve(count);
  for (int k = 0; k < count; ++k)
    exposures.emplace_back(static_cast<std::int64_t>(base * std::pow(ratio, k)));
  return exposures;
}

}  // namespace symrig
