// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/genicam/features.hpp"
#include "symrig/base/result.hpp"
#include "symrig/camera/camera_info.hpp"
#include "symrig/camera/internal/frame_reader.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"

#include <string>
#include <string_view>

namespace symrig::camera {

/// An open camera and what the network or bus says about it.
struct OpenDevice {
  Owned<ArvDevice> device;
  FoundCamera found;
};

/// wanted: a path, serial number, bus, name or IP address as find_genicam_cameras() returns them; empty: the
/// only camera. An IP address needs no broadcast.
/// fails: device_lost (no camera), unknown_name (no match; the text lists the cameras), bad_argument (several
/// match), device_refused (another program controls it).
Result<OpenDevice> open_device(std::string_view wanted);

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
