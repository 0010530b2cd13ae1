// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::report {

/// The values of a stored capture_json, read leniently, because older or newer commands may omit keys. A key
/// of the wrong type counts as absent.
class CaptureFacts {
 public:
  explicit CaptureFacts(std::string_view json);

  /// path: JSON pointer, "/seconds/total".
  std::optional<double> number(const char* path) const;
  std::optional<std::string> text(const char* path) const;
  std::vector<double> numbers(const char* path) const;
  const nlohmann::json& json() const { return json_; }
  /// nullptr if there is no value.
  const nlohmann::json* find(const char* path) const;

 private:
  nlohmann::json json_;
};

}  // namespace symrig::report
