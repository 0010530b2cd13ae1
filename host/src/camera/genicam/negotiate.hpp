// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/frame_reader.hpp"
#include "camera/genicam/features.hpp"
#include "camera/genicam/genicam_camera.hpp"

#include <string>

namespace symrig::camera {

/// The chunks that the camera sends. Empty names: it has none.
struct ChunkNames {
  std::string counter, exposure;
};

/// Sets format, region, trigger, exposure, gain and the other features, in this order.
/// fails: as GenicamCamera::open().
Result<PictureLayout> set_up(Features& features, const GenicamSettings& settings);
/// Switches the trigger counter and the exposure time on, as far as the camera has them.
Result<ChunkNames> set_chunks(Features& features, bool wanted);
/// The settings' timing, made as slow as the camera's own nodes say. overlap: its triggers may overlap
/// readouts.
CameraTiming camera_timing(const Features& features, bool overlap, CameraTiming timing);

}  // namespace symrig::camera
