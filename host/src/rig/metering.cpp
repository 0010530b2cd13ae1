// SPDX-License-Identifier: Apache-2.0
#include "rig/exposure_choice.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {

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
