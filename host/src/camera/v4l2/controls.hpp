// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/v4l2/open_node.hpp"
#include "symrig/camera/camera_info.hpp"

#include <cstdint>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// All enabled controls with their values, in the driver's order.
/// fails: device_lost.
Result<std::vector<ControlInfo>> read_controls(OpenNode& driver);

/// Finds a control by name or title.
/// fails: unknown_name (the hint gives the nearest name).
Result<ControlInfo> find_control(OpenNode& driver, std::string_view name);

/// Reads a value for this control from text: a number, a menu entry, or on/off/true/false.
/// fails: bad_argument (out of range or between steps; the hint gives the nearest value).
Result<std::int64_t> control_value(const ControlInfo& control, std::string_view text);

/// Sets the control and reads it back.
/// fails: bad_argument, device_lost, device_refused (read-only, refused by the driver, or the driver stored
/// another value).
Result<void> set_control(OpenNode& driver, const ControlInfo& control, std::int64_t value);
Result<std::int64_t> get_control(OpenNode& driver, const ControlInfo& control);

}  // namespace symrig::camera
