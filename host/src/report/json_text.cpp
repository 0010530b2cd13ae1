// SPDX-License-Identifier: Apache-2.0

#include "symrig/report/internal/json_text.hpp"

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

std::string json_text(const Json& json) {
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Json grid_json(Grid grid) {
  return Json::array({grid.rows, grid.cols});
}

Json leaves_json(const TransportTensor& tensor) {
  Json rank1 = Json::array(), low_rank = Json::array(), empty = Json::array(), scalar = Json::array();
  for (const LeafCounts& level : tensor.leaves_per_level()) {
    rank1.push_back(level.rank1);
    low_rank.push_back(level.low_rank);
    empty.push_back(level.empty);
    scalar.push_back(level.scalar);
  }
  return {{"rank1", rank1}, {"lowrank", low_rank}, {"empty", empty}, {"scalar", scalar}};
}

void add_made(Json& json, const Made& made) {
  if (!made.date.empty()) json["date"] = made.date;
  if (!made.version.empty()) json["version"] = made.version;
  if (!made.command_line.empty()) json["command_line"] = made.command_line;
}

Json held_out_json(const std::vector<HeldOutError>& all) {
  Json list = Json::array();
  for (const HeldOutError& one : all)
    list.push_back({{"name", one.name},
                    {"rms", one.rms},
                    {"mean_white", one.mean_white},
                    {"relative", one.relative()},
                    {"lit_pixels", one.lit_pixels}});
  return list;
}

}  // namespace symrig::report
