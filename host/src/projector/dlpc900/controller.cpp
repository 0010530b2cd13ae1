// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc900/controller.hpp"

#include <array>

namespace symrig::projector::dlpc900 {
namespace {

using dlp::Bytes;
using dlp::Command;

constexpr std::size_t kTimingBytes = 18, kTriggerBytes = 5, kCountBytes = 6;

Command trigger_command(int number) {
  return number == 1 ? Command::trigger_out_1 : Command::trigger_out_2;
}

}  // namespace

std::string_view name_of(DisplayMode mode) {
  constexpr std::array<std::string_view, 4> kNames{"video", "stored patterns", "video patterns",
                                                   "loaded patterns"};
  return kNames[static_cast<std::size_t>(mode)];
}

Result<std::uint8_t> Controller::mirrors() {
  return byte(Command::hardware_type);
}

/// Pixels and lines with blanking, active pixels and lines, three places of the first ones, the clock in kHz.
Result<dlp::Signal> Controller::signal() {
  SYMRIG_TRY(const dlp::Status state, status());
  SYMRIG_TRY(const Bytes data, dialogue().read(Command::source_timing, kTimingBytes));
  const double total = static_cast<double>(dlp::half(data, 0)) * dlp::half(data, 2);
  dlp::Signal signal;
  signal.locked = is_locked(state);
  signal.cols = dlp::half(data, 4);
  signal.rows = dlp::half(data, 6);
  if (total > 0) signal.refresh_hz = 1e3 * dlp::word(data, 14) / total;
  return signal;
}

Result<DisplayMode> Controller::display_mode() {
  SYMRIG_TRY(const std::uint8_t mode, byte(Command::display_mode));
  return static_cast<DisplayMode>(mode & 3U);
}

Result<void> Controller::set_display_mode(DisplayMode mode) {
  return dialogue().write(Command::display_mode, static_cast<std::uint8_t>(mode));
}

Result<std::uint8_t> Controller::receiver() {
  return byte(Command::receiver);
}

Result<void> Controller::set_receiver(std::uint8_t receiver) {
  return dialogue().write(Command::receiver, receiver);
}

Result<Counts> Controller::counts() {
  SYMRIG_TRY(const Bytes data, dialogue().read(Command::pattern_count, kCountBytes));
  return Counts{dlp::half(data, 0), dlp::word(data, 2)};
}

Result<void> Controller::set_counts(const Counts& counts) {
  Bytes data;
  dlp::append(data, static_cast<std::uint32_t>(counts.entries), 2);
  dlp::append(data, counts.shown, 4);
  return dialogue().write(Command::pattern_count, data);
}

Result<void> Controller::set_table(const std::vector<TableEntry>& entries) {
  for (const TableEntry& entry : entries)
    SYMRIG_CHECK(dialogue().write(Command::table_data, to_bytes(entry)));
  return {};
}

Result<TriggerOut> Controller::trigger_out(int number) {
  SYMRIG_TRY(const Bytes data, dialogue().read(trigger_command(number), kTriggerBytes));
  return TriggerOut{(data[0] & 1U) != 0, static_cast<std::int16_t>(dlp::half(data, 1)),
                    static_cast<std::int16_t>(dlp::half(data, 3))};
}

Result<void> Controller::set_trigger_out(int number, const TriggerOut& out) {
  Bytes data{static_cast<std::uint8_t>(out.inverted ? 1 : 0)};
  dlp::append(data, static_cast<std::uint16_t>(out.rising), 2);
  dlp::append(data, static_cast<std::uint16_t>(out.falling), 2);
  return dialogue().write(trigger_command(number), data);
}

}  // namespace symrig::projector::dlpc900
