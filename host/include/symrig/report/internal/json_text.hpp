// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/summary.hpp"
#include "symrig/tensor/transport_tensor.hpp"

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

/// Parts of all `--json` files. Keys stay in the order in which they are set.

namespace symrig::report {

using Json = nlohmann::ordered_json;

/// JSON as text: indented, ends with a newline. NaN and infinity become null, because JSON has none.
std::string json_text(const Json& json);
Json grid_json(Grid grid);
/// {rank1, lowrank, empty, scalar}, each with one number for each level.
Json leaves_json(const TransportTensor& tensor);

/// Adds `date`, `version` and `command_line`, if known.
void add_made(Json& json, const Made& made);

/// One object for each photograph: name, rms, mean_white, relative, lit_pixels.
Json held_out_json(const std::vector<HeldOutError>& all);

}  // namespace symrig::report
