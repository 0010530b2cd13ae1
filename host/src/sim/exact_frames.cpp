// SPDX-License-Identifier: Apache-2.0
#include "sim/exact_frames.hpp"

#include "rig/live_pixels.hpp"

#include <fmt/format.h>

namespace symrig::sim {

namespace {

/// nullptr: the frame carries no light.
ImageFormation::Light light_of(const CameraFrame& frame) {
  const auto* light = std::any_cast<ImageFormation::Light>(&frame.attachment);
  return light == nullptr ? nullptr : *light;
}

}  // namespace

std::optional<double> ExactFrames::brightest_rate(const CameraFrame& frame, Nanoseconds /*exposure*/,
                                                  const Camera& camera, double scale) const {
  const ImageFormation::Light light = light_of(frame);
  if (light == nullptr) return std::nullopt;
  return largest_live(light->values(), camera) / scale;
}

Result<Radiance> ExactFrames::photograph(std::span<const CameraFrame> frames,
                                         std::span<const Nanoseconds> /*exposures*/, const Camera& camera,
                                         const PhotographUnits& units) const {
  const ImageFormation::Light seen = light_of(frames.back());
  if (seen == nullptr)
    return Error{ErrorCode::frame_missing, fmt::format("frame {} has no light", frames.back().sequence),
                 "take the photograph again"};
  Radiance radiance{*seen, Image<float>(seen->grid(), seen->channels()),
                    Image<std::uint8_t>(seen->grid(), seen->channels(), 1)};
  for (float& value : radiance.mean.values()) value *= static_cast<float>(1 / units.lamp);
  const Image<std::uint8_t>* dead = camera.dead();
  if (dead == nullptr) return radiance;
  for (int c = 0; c < seen->channels(); ++c) {
    for (std::size_t i = 0; i < dead->values().size(); ++i) {
      if (dead->values()[i] == 0) continue;
      radiance.mean.plane(c)[i] = 0;
      radiance.valid.plane(c)[i] = 0;
    }
  }
  return radiance;
}

}  // namespace symrig::sim
