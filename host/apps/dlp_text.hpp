// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/dlp_controller.hpp"

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::apps {

/// The table of `symrig list`: one line for each DLP controller. Empty if there is none.
std::string controllers_table(const std::vector<DlpController>& controllers);

/// The text of `symrig info --projector`.
std::string controller_text(const DlpController& controller);

/// One controller as JSON. Values of a controller that did not answer are null.
nlohmann::ordered_json controller_json(const DlpController& controller);
nlohmann::ordered_json controllers_json(const std::vector<DlpController>& controllers);

}  // namespace symrig::apps
