// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/genicam/glib.hpp"
#include "symrig/base/result.hpp"
#include "symrig/camera/camera_info.hpp"

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

}  // namespace symrig::camera
