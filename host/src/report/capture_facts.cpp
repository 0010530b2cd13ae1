// SPDX-License-Identifier: Apache-2.0
#include "report/capture_facts.hpp"

#include "symrig/base/internal/json_reader.hpp"

namespace symrig::report {

CaptureFacts::CaptureFacts(std::string_view json)
    : json_(check_json_nesting(json) ? nlohmann::json::parse(json.begin(), json.end(), nullptr, false)
                                     : nlohmann::json::object()) {
  if (!json_.is_object()) json_ = nlohmann::json::object();
}

const nlohmann::json* CaptureFacts::find(const char* path) const {
  const nlohmann::json::json_pointer pointer(path);
  return json_.contains(pointer) ? &json_.at(pointer) : nullptr;
}

std::optional<double> CaptureFacts::number(const char* path) const {
  const nlohmann::json* found = find(path);
  if (found == nullptr || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

std::optional<std::string> CaptureFacts::text(const char* path) const {
  const nlohmann::json* found = find(path);
  if (found == nullptr || !found->is_string()) return std::nullopt;
  return found->get<std::string>();
}

std::vector<double> CaptureFacts::numbers(const char* path) const {
  const nlohmann::json* found = find(path);
  std::vector<double> values;
  if (found == nullptr || !found->is_array()) return values;
  for (const nlohmann::json& one : *found)
    if (one.is_number()) values.push_back(one.get<double>());
  return values;
}

}  // namespace symrig::report
