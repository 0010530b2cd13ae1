// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/display.hpp"

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::apps {

/// The table of `symrig list` for people: one line a connector, its modes below. Empty if there is none.
std::string projectors_table(const std::vector<Display>& displays);

/// The same for scripts: an array, one object a connector.
nlohmann::ordered_json projectors_json(const std::vector<Display>& displays);

}  // namespace symrig::apps
