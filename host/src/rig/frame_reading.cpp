// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/frame_reading.hpp"

#include "symrig/hdr/merge.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig {
namespace {

std::vector<Frame> codes_of(std::span<const CameraFrame> frames, std::span<const Nanoseconds> exposures) {
  std::vector<Frame> codes;
  for (std::size_t i = 0; i < frames.size(); ++i) codes.push_back({frames[i].raw, exposures[i]});
  return codes;
}

}  // namespace

std::optional<double> FrameReading::brightest_rate(const CameraFrame& frame, Nanoseconds exposure,
                                                   const Camera& camera, double /*scale*/) const {
  const NoiseModel& noise = camera.noise();
  const double code = largest_live(std::span<const std::uint16_t>(frame.raw), camera);
  if (code >= noise.saturation_code()) return std::nullopt;
  return std::max(0.0, code - noise.pedestal()) / noise.gain() / seconds(exposure);
}

Result<Radiance> FrameReading::photograph(std::span<const CameraFrame> frames,
                                          std::span<const Nanoseconds> exposures, const Camera& camera,
                                          const PhotographUnits& units) const {
  MergeOptions options;
  options.scale = units.scale / units.lamp;  // black was taken at the first level
  options.black = units.black;
  options.dead = camera.dead();
  const std::vector<Frame> codes = codes_of(frames, exposures);
  if (codes.size() <= kMaxFrames)
    return merge(codes, camera.grid(), camera.channels(), camera.noise(), options);
  SYMRIG_TRY(MergeStream stream,
             MergeStream::begin(camera.grid(), camera.channels(), camera.noise(), exposures));
  for (const Frame& frame : codes) SYMRIG_CHECK(stream.add(frame));
  return stream.finish(options);
}

std::string FrameReading::contradicted_exposures(std::span<const CameraFrame> frames,
                                                 std::span<const Nanoseconds> exposures,
                                                 const NoiseModel& noise) const {
  const auto ratios = exposure_ratios(codes_of(frames, exposures), noise);
  if (!ratios) return "";
  const ExposureRatio* worst = nullptr;
  const auto off = [](const ExposureRatio& ratio) { return std::abs(ratio.seen / ratio.stated - 1); };
  for (const ExposureRatio& ratio : *ratios)
    if (ratio.wrong() && (worst == nullptr || off(ratio) > off(*worst))) worst = &ratio;
  return worst == nullptr ? "" : worst->to_string();
}

}  // namespace symrig
