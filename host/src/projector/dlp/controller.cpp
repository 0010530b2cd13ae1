// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/controller.hpp"

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

constexpr std::size_t kVersionBytes = 16;

}  // namespace

std::string to_string(const Version& version) {
  return fmt::format("{}.{}.{}", version.major, version.minor, version.patch);
}

Result<std::uint8_t> Controller::byte(Command command) {
  SYMRIG_TRY(const Bytes data, dialogue_.read(command, 1));
  return data[0];
}

Result<Version> Controller::version() {
  SYMRIG_TRY(const Bytes data, dialogue_.read(Command::version, kVersionBytes));
  return Version{data[3], data[2], half(data, 0)};
}

Result<Status> Controller::status() {
  Status status;
  SYMRIG_TRY(status.hardware, byte(Command::hardware_status));
  SYMRIG_TRY(status.system, byte(Command::system_status));
  SYMRIG_TRY(status.main, byte(Command::main_status));
  return status;
}

Result<bool> Controller::standby() {
  SYMRIG_TRY(const std::uint8_t power, byte(Command::power));
  return (power & 3U) != 0;
}

Result<std::uint8_t> Controller::source() {
  return byte(Command::source);
}

Result<void> Controller::set_source(std::uint8_t source) {
  return dialogue_.write(Command::source, source);
}

Result<LedEnable> Controller::led_enable() {
  SYMRIG_TRY(const std::uint8_t bits, byte(Command::led_enable));
  return LedEnable{static_cast<std::uint8_t>(bits & kAllLeds), (bits & 8U) != 0};
}

Result<void> Controller::set_led_enable(const LedEnable& enable) {
  return dialogue_.write(Command::led_enable,
                         static_cast<std::uint8_t>((enable.leds & kAllLeds) | (enable.by_sequencer ? 8 : 0)));
}

Result<LedCurrents> Controller::led_currents() {
  SYMRIG_TRY(const Bytes data, dialogue_.read(Command::led_current, 3));
  return LedCurrents{data[0], data[1], data[2]};
}

Result<void> Controller::set_led_currents(const LedCurrents& currents) {
  return dialogue_.write(Command::led_current, currents);
}

Result<void> Controller::set_run(Run run) {
  return dialogue_.write(Command::run, static_cast<std::uint8_t>(run));
}

Result<void> check_ready(Controller& controller) {
  SYMRIG_TRY(const bool standby, controller.standby());
  if (standby)
    return Error{ErrorCode::device_refused, fmt::format("{} is in standby", controller.name()),
                 "switch the projector on"};
  SYMRIG_TRY(const Status status, controller.status());
  if (status.initialized() && !status.sequencer_error()) return {};
  return Error{ErrorCode::device_refused,
               fmt::format("{} reports {} (hardware status {:#04x})", controller.name(),
                           status.initialized() ? "an error of its sequencer" : "that it is not initialized",
                           status.hardware),
               "disconnect its power, and connect it again"};
}

}  // namespace symrig::projector::dlp
