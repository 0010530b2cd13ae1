// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc350/look.hpp"

#include "projector/dlpc350/find_controllers.hpp"

#include <array>
#include <utility>

namespace symrig {
namespace projector::dlpc350 {
namespace {

std::string leds_text(const LedEnable& enable) {
  if (enable.by_sequencer) return "sequence";
  constexpr std::array<std::string_view, 3> kNames{"red", "green", "blue"};
  std::string text;
  for (std::size_t k = 0; k < kNames.size(); ++k)
    if ((enable.leds >> k & 1U) != 0) text += (text.empty() ? "" : " ") + std::string(kNames[k]);
  return text.empty() ? "none" : text;
}

DlpController described(const FoundController& found) {
  DlpController controller;
  controller.path = found.path;
  controller.product = found.product.empty() ? "DLPC350" : found.product;
  controller.serial = found.serial;
  return controller;
}

Result<void> ask_at(const std::string& path, DlpController& found) {
  SYMRIG_TRY(auto transport, open_transport(path));
  Controller controller(std::move(transport), Nanoseconds{300'000'000});
  return look(controller, found);
}

}  // namespace

Result<void> look(Controller& controller, DlpController& found) {
  SYMRIG_TRY(const Version version, controller.version());
  found.firmware = to_string(version);
  SYMRIG_TRY(found.standby, controller.standby());
  SYMRIG_TRY(const Status status, controller.status());
  found.parked = status.parked();
  found.healthy = status.initialized() && !status.sequencer_error() && !status.sequencer_aborted();
  SYMRIG_TRY(found.patterns, controller.shows_patterns());
  SYMRIG_TRY(const Run run, controller.run());
  found.running = found.patterns && run == Run::start;
  SYMRIG_TRY(const LedEnable enable, controller.led_enable());
  found.leds = leds_text(enable);
  SYMRIG_TRY(const LedCurrents currents, controller.led_currents());
  found.currents = {currents[0], currents[1], currents[2]};
  SYMRIG_TRY(const Signal signal, controller.signal());
  found.signal = {signal.locked, {signal.rows, signal.cols}, signal.refresh_hz};
  return {};
}

}  // namespace projector::dlpc350

std::vector<DlpController> find_dlp_controllers() {
  std::vector<DlpController> all;
  for (const auto& found : projector::dlpc350::find_controllers()) {
    DlpController one = projector::dlpc350::described(found);
    if (const auto asked = projector::dlpc350::ask_at(found.path, one); !asked)
      one.error = asked.error().line();
    all.push_back(std::move(one));
  }
  return all;
}

Result<DlpController> look_at_dlp_controller(const std::string& path) {
  DlpController controller;
  controller.path = path;
  controller.product = "DLPC350";
  for (const auto& found : projector::dlpc350::find_controllers())
    if (found.path == path) controller = projector::dlpc350::described(found);
  SYMRIG_CHECK(projector::dlpc350::ask_at(path, controller));
  return controller;
}

}  // namespace symrig
