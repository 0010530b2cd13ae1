// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera_info.hpp"

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::apps {

/// Information on each connected camera; for a camera that cannot be opened, the error.
std::vector<CameraInfo> look_at_cameras();
/// For each camera an empty line, then a few lines: the camera, its supported formats, the names of its
/// controls.
std::string cameras_summary(const std::vector<CameraInfo>& cameras);
nlohmann::ordered_json cameras_json(const std::vector<CameraInfo>& cameras);

/// Everything about one camera: a table of formats with sizes and rates, a table of controls with values and
/// ranges.
std::string camera_text(const CameraInfo& camera);
/// The keys of docs/command-line.md. Sizes are [rows, columns].
nlohmann::ordered_json camera_json(const CameraInfo& camera);

}  // namespace symrig::apps
