// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <nlohmann/json.hpp>

namespace symrig::apps {

/// JSON as text. Names may contain bytes that are not UTF-8, which JSON does not allow: each becomes U+FFFD.
inline std::string json_text(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace symrig::apps
