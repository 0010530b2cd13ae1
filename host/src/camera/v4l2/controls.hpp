// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/v4l2/open_node.hpp"
#include "symrig/camera/camera_info.hpp"

#include <cstdint>
#include <string_view>
#include <vector>

namespace symrig::camera {

/// All controls that are not disabled, in the driver's order, with their values.  fails: device_lost.
Result<std::vector<ControlInfo>> read_controls(OpenNode& driver);

/// The control of that name, or title.  fails: unknown_name (the hint names the nearest).
Result<ControlInfo> find_control(OpenNode& driver, std::string_view name);

/// A value as it may be written for this control: a number, the text of a menu's entry, on/off/true/false.
/// fails: bad_argument (out of range or between steps: the hint names the nearest value).
Result<std::int64_t> control_value(const ControlInfo& control, std::string_view text);

/// Sets and reads back.  fails: bad_argument, device_lost, device_refused (read-only; the driver refuses, or
/// holds another value afterwards: its error names it).
Result<void> set_control(OpenNode& driver, const ControlInfo& control, std::int64_t value);
Result<std::int64_t> get_control(OpenNode& driver, const ControlInfo& control);

}  // namespace symrig::camera
