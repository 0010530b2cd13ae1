// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/look.hpp"

#include <array>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

std::string leds_text(const LedEnable& enable) {
  if (enable.by_sequencer) return "sequence";
  constexpr std::array<std::string_view, 3> kNames{"red", "green", "blue"};
  std::vector<std::string_view> on;
  for (std::size_t k = 0; k < kNames.size(); ++k)
    if ((enable.leds >> k & 1U) != 0) on.push_back(kNames[k]);
  return on.empty() ? "none" : fmt::format("{}", fmt::join(on, " "));
}

}  // namespace

Result<void> look_at_common(Controller& controller, DlpController& found) {
  SYMRIG_TRY(const Version version, controller.version());
  found.firmware = to_string(version);
  SYMRIG_TRY(found.standby, controller.standby());
  SYMRIG_TRY(const Status status, controller.status());
  found.parked = status.parked();
  found.healthy = status.initialized() && !status.sequencer_error() && !status.sequencer_aborted();
  SYMRIG_TRY(const LedEnable enable, controller.led_enable());
  found.leds = leds_text(enable);
  SYMRIG_TRY(const LedCurrents currents, controller.led_currents());
  found.currents = {currents[0], currents[1], currents[2]};
  return {};
}

}  // namespace symrig::projector::dlp
