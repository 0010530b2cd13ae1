// SPDX-License-Identifier: Apache-2.0

#include "device_text.hpp"

#include <algorithm>
#include <string_view>

#include <fmt/format.h>

namespace symrig::apps {

namespace {

using Json = nlohmann::ordered_json;

std::string_view name(ControlKind kind) {
  switch (kind) {
    case ControlKind::integer:
      return "integer";
    case ControlKind::boolean:
      return "boolean";
    case ControlKind::menu:
      return "menu";
    case ControlKind::button:
      return "button";
    case ControlKind::bitmask:
      return "bitmask";
    case ControlKind::other:
      break;
  }
  return "other";
}

/// "usb-0000:00:14.0-2, serial 4103"; without the serial number if the camera reports none.
std::string place(const FoundCamera& camera) {
  return camera.serial.empty() ? camera.bus : fmt::format("{}, serial {}", camera.bus, camera.serial);
}

std::string size_text(const SizeOffer& size) {
  if (size.single()) return to_string(size.least);
  const std::string step = size.step == Grid{1, 1} ? "" : fmt::format(" by {}", to_string(size.step));
  return fmt::format("{} to {}{}", to_string(size.least), to_string(size.most), step);
}

std::string rate_text(const SizeOffer& size) {
  if (size.fastest == 0) return "";
  if (size.slowest == size.fastest) return fmt::format(" at {:.4g}/s", size.fastest);
  return fmt::format(" at {:.4g} to {:.4g}/s", size.slowest, size.fastest);
}

std::string sizes_text(const FormatOffer& offer) {
  std::string text;
  for (const SizeOffer& size : offer.sizes)
    text += (text.empty() ? "" : ", ") + size_text(size) + rate_text(size);
  return text.empty() ? "-" : text;
}

std::string format_row(const FormatOffer& offer) {
  if (offer.format == nullptr)
    return fmt::format("  {:<10} not supported: {}\n", offer.name(), offer.description);
  return fmt::format("  {:<10} {:>4}  {:<7} {:<6}  {}\n", offer.name(), offer.format->bits,
                     symrig::name(offer.format->mosaic), offer.format->linear ? "yes" : "no",
                     sizes_text(offer));
}

/// Names of the formats that symrig cannot read.
std::string unread(const CameraInfo& camera) {
  std::string names;
  for (const FormatOffer& offer : camera.formats)
    if (offer.format == nullptr) names += fmt::format(" {}", offer.name());
  return names;
}

std::string value_text(const ControlInfo& control) {
  return control.value ? std::to_string(*control.value) : "-";
}

std::string control_row(const ControlInfo& control, std::size_t widest) {
  const char* state = control.read_only  ? "; read-only"
                      : control.inactive ? "; inactive: another control sets it"
                                         : "";
  return fmt::format("  {:<{}}  {:>8}  {}{}\n", control.name, widest, value_text(control), control.range(),
                     state);
}

Json size_json(const SizeOffer& size) {
  const auto grid = [](Grid g) { return Json::array({g.rows, g.cols}); };
  const auto rate = [](double r) { return r == 0 ? Json() : Json(r); };
  return {{"least", grid(size.least)},
          {"most", grid(size.most)},
          {"step", grid(size.step)},
          {"slowest", rate(size.slowest)},
          {"fastest", rate(size.fastest)}};
}

Json format_json(const FormatOffer& offer) {
  const bool read = offer.format != nullptr;
  Json json{{"format", offer.name()},
            {"fourcc", fourcc_text(offer.fourcc)},
            {"description", offer.description},
            {"read", read},
            {"bits", read ? Json(offer.format->bits) : Json()},
            {"mosaic", read ? Json(symrig::name(offer.format->mosaic)) : Json()},
            {"linear", read ? Json(offer.format->linear) : Json()},
            {"sizes", Json::array()}};
  for (const SizeOffer& size : offer.sizes) json["sizes"].push_back(size_json(size));
  return json;
}

Json control_json(const ControlInfo& control) {
  Json json{{"name", control.name},           {"title", control.title},
            {"kind", name(control.kind)},     {"value", control.value ? Json(*control.value) : Json()},
            {"least", control.least},         {"most", control.most},
            {"step", control.step},           {"default", control.preset},
            {"read_only", control.read_only}, {"inactive", control.inactive},
            {"menu", Json::array()}};
  for (const MenuItem& item : control.menu)
    json["menu"].push_back({{"value", item.value}, {"text", item.text}});
  return json;
}

/// Three lines: the camera, its supported formats, its controls. One line with the error if it cannot be
/// opened.
std::string camera_summary(const CameraInfo& camera) {
  const FoundCamera& found = camera.found;
  if (found.error) return fmt::format("{}: {}\n", found.path, found.error->line());
  std::string formats, controls;
  std::size_t others = 0;
  for (const FormatOffer& offer : camera.formats)
    if (offer.format == nullptr)
      ++others;
    else
      formats += fmt::format(" {}", offer.name());
  for (const ControlInfo& control : camera.controls)
    controls += (controls.empty() ? " " : ", ") + control.name;
  return fmt::format("{}  {} ({}, {})\n  formats {}{}\n  controls {}\n", found.path, found.name, found.driver,
                     place(found), formats.empty() ? " -" : formats,
                     others == 0 ? "" : fmt::format(", and {} not supported", others),
                     controls.empty() ? " -" : controls);
}

}  // namespace

std::vector<CameraInfo> look_at_cameras() {
  std::vector<CameraInfo> cameras;
  for (FoundCamera& found : find_cameras()) {
    auto info = found.error ? Result<CameraInfo>(*found.error) : look_at_camera(found.path);
    if (!info) {
      found.error = info.error();
      info = CameraInfo{std::move(found), {}, {}};
    }
    cameras.push_back(*std::move(info));
  }
  return cameras;
}

std::string cameras_summary(const std::vector<CameraInfo>& cameras) {
  std::string text;
  for (const CameraInfo& camera : cameras) text.append(1, '\n').append(camera_summary(camera));
  return text;
}

nlohmann::ordered_json cameras_json(const std::vector<CameraInfo>& cameras) {
  Json json = Json::array();
  for (const CameraInfo& camera : cameras) json.push_back(camera_json(camera));
  return json;
}

std::string camera_text(const CameraInfo& camera) {
  const FoundCamera& found = camera.found;
  std::string text = fmt::format("{}\n  node           {}\n  driver         {}\n  place          {}\n",
                                 found.name, found.path, found.driver, place(found));
  text += fmt::format("  {:<10} {:>4}  {:<7} {:<6}  {}\n", "format", "bits", "colours", "linear",
                      "sizes, rows x columns");
  for (const FormatOffer& offer : camera.formats) text += format_row(offer);
  if (const std::string others = unread(camera); !others.empty()) text += "  not supported:" + others + "\n";
  std::size_t widest = 7;
  for (const ControlInfo& control : camera.controls) widest = std::max(widest, control.name.size());
  text += fmt::format("  {:<{}}  {:>8}  {}\n", "control", widest, "value", "range");
  for (const ControlInfo& control : camera.controls) text += control_row(control, widest);
  return text;
}

nlohmann::ordered_json camera_json(const CameraInfo& camera) {
  const FoundCamera& found = camera.found;
  Json json{{"node", found.path},       {"name", found.name},
            {"driver", found.driver},   {"bus", found.bus},
            {"serial", found.serial},   {"error", found.error ? Json(found.error->line()) : Json()},
            {"formats", Json::array()}, {"controls", Json::array()}};
  for (const FormatOffer& offer : camera.formats) json["formats"].push_back(format_json(offer));
  for (const ControlInfo& control : camera.controls) json["controls"].push_back(control_json(control));
  return json;
}

namespace {

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
