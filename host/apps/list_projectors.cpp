// SPDX-License-Identifier: Apache-2.0
#include "list_projectors.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

using Json = nlohmann::ordered_json;

/// The modes that can show a pattern, each once. A star marks the preferred mode.
std::string modes_text(const Display& display) {
  std::vector<std::string> names;
  for (const DisplayMode& mode : display.modes) {
    const std::string name = to_string(mode);
    const auto same = [&](const std::string& other) { return other == name || other == name + "*"; };
    if (!mode.interlaced && std::none_of(names.begin(), names.end(), same))
      names.push_back(mode.preferred ? name + "*" : name);
  }
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : " ") + name;
  return text;
}

std::string row(const Display& display, std::size_t width) {
  if (!display.error.empty()) return fmt::format("{}: {}\n", display.connector, display.error);
  const std::string model = display.model.empty() ? "-" : display.model;
  const std::string what = display.connected ? modes_text(display) : "nothing connected";
  return fmt::format("{:<{}}  {:<8}  {:<13}  {}\n", display.connector, width, display.driver, model, what);
}

Json mode_json(const DisplayMode& mode) {
  return {{"mode", to_string(mode)},
          {"size", {mode.grid.rows, mode.grid.cols}},
          {"period_ns", mode.period.count()},
          {"preferred", mode.preferred},
          {"interlaced", mode.interlaced}};
}

}  // namespace

std::string projectors_table(const std::vector<Display>& displays) {
  if (displays.empty()) return {};
  std::size_t width = std::string_view("projector").size();
  for (const Display& display : displays) width = std::max(width, display.connector.size());
  std::string text =
      fmt::format("\n{:<{}}  {:<8}  {:<13}  modes (* preferred)\n", "projector", width, "driver", "model");
  for (const Display& display : displays) text += row(display, width);
  return text;
}

Json projectors_json(const std::vector<Display>& displays) {
  Json all = Json::array();
  for (const Display& display : displays) {
    Json modes = Json::array();
    for (const DisplayMode& mode : display.modes) modes.push_back(mode_json(mode));
    all.push_back({{"connector", display.connector},
                   {"driver", display.driver.empty() ? Json() : Json(display.driver)},
                   {"connected", display.connected},
                   {"model", display.model.empty() ? Json() : Json(display.model)},
                   {"modes", std::move(modes)},
                   {"error", display.error.empty() ? Json() : Json(display.error)}});
  }
  return all;
}

}  // namespace symrig::apps
