// SPDX-License-Identifier: Apache-2.0
#include "dlp_text.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

using Json = nlohmann::ordered_json;

std::string signal_text(const DlpSignal& signal) {
  if (!signal.locked) return "no signal";
  return fmt::format("{}x{}@{:.4g}", signal.grid.cols, signal.grid.rows, signal.refresh_hz);
}

std::string mode_text(const DlpController& controller) {
  if (controller.standby) return "standby";
  if (!controller.patterns) return "video";
  return controller.running ? "patterns" : "patterns, stopped";
}

std::string controller_row(const DlpController& controller, std::size_t width) {
  if (!controller.error.empty()) return fmt::format("{}: {}\n", controller.path, controller.error);
  return fmt::format("{:<{}}  {:<8}  {:<8}  {:<17}  {}\n", controller.path, width, controller.product,
                     controller.firmware, mode_text(controller), signal_text(controller.signal));
}

}  // namespace

std::string controllers_table(const std::vector<DlpController>& controllers) {
  if (controllers.empty()) return {};
  std::size_t width = std::string_view("controller").size();
  for (const DlpController& one : controllers) width = std::max(width, one.path.size());
  std::string text = fmt::format("\n{:<{}}  {:<8}  {:<8}  {:<17}  signal\n", "controller", width, "product",
                                 "firmware", "mode");
  for (const DlpController& one : controllers) text += controller_row(one, width);
  return text;
}

std::string controller_text(const DlpController& controller) {
  return fmt::format(
      "{} {}{}\n"
      "  firmware       {}\n"
      "  mirrors        {}; {}\n"
      "  state          {}\n"
      "  mode           {}\n"
      "  signal         {}\n"
      "  LEDs           {}; currents red {}, green {}, blue {} of 255\n"
      "  temperature    not reported by this controller\n",
      controller.product, controller.path, controller.serial.empty() ? "" : " " + controller.serial,
      controller.firmware, controller.mirrors.empty() ? "kind not reported" : controller.mirrors,
      controller.parked ? "parked" : "not parked",
      controller.healthy ? "no error" : "error of its sequencer, or not initialized", mode_text(controller),
      signal_text(controller.signal), controller.leds, controller.currents[0], controller.currents[1],
      controller.currents[2]);
}

Json controller_json(const DlpController& controller) {
  const bool answered = controller.error.empty();
  const auto known = [answered](Json value) { return answered ? std::move(value) : Json(); };
  const DlpSignal& signal = controller.signal;
  return {{"path", controller.path},
          {"product", controller.product},
          {"serial", controller.serial.empty() ? Json() : Json(controller.serial)},
          {"firmware", known(controller.firmware)},
          {"mirrors", answered && !controller.mirrors.empty() ? Json(controller.mirrors) : Json()},
          {"healthy", known(controller.healthy)},
          {"standby", known(controller.standby)},
          {"parked", known(controller.parked)},
          {"patterns", known(controller.patterns)},
          {"running", known(controller.running)},
          {"leds", known(controller.leds)},
          {"currents", known(controller.currents)},
          {"signal", answered && signal.locked ? Json{{"size", {signal.grid.rows, signal.grid.cols}},
                                                      {"refresh_hz", signal.refresh_hz}}
                                               : Json()},
          {"error", answered ? Json() : Json(controller.error)}};
}

Json controllers_json(const std::vector<DlpController>& controllers) {
  Json all = Json::array();
  for (const DlpController& one : controllers) all.push_back(controller_json(one));
  return all;
}

}  // namespace symrig::apps
