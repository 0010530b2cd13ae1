// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera_info.hpp"
#include "symrig/projector/find_projectors.hpp"

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

/// The table of `symrig list`: one line for each DLP controller. Empty if there is none.
std::string controllers_table(const std::vector<DlpController>& controllers);

/// The text of `symrig info --projector`.
std::string controller_text(const DlpController& controller);

/// One controller as JSON. Values of a controller that did not answer are null.
nlohmann::ordered_json controller_json(const DlpController& controller);
nlohmann::ordered_json controllers_json(const std::vector<DlpController>& controllers);

}  // namespace symrig::apps
