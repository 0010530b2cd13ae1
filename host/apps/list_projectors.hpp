// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/display.hpp"

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::apps {

/// The table of `symrig list`: one line for each connector, with its modes. Empty if there is no connector.
std::string projectors_table(const std::vector<Display>& displays);

/// The same as JSON: an array with one object for each connector.
nlohmann::ordered_json projectors_json(const std::vector<Display>& displays);

}  // namespace symrig::apps
