// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/dlpc900.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlpc900 {

dlp::Bytes to_bytes(const TableEntry& entry) {
  dlp::Bytes bytes;
  dlp::append(bytes, static_cast<std::uint32_t>(entry.index), 2);
  dlp::append(bytes, entry.exposure_us, 3);
  bytes.push_back(static_cast<std::uint8_t>((entry.clears ? 1 : 0) | (entry.bits - 1) << 1U |
                                            (entry.leds & dlp::kAllLeds) << 4U | (entry.waits ? 0x80 : 0)));
  dlp::append(bytes, entry.dark_us, 3);
  bytes.push_back(entry.no_trigger_2 ? 1 : 0);
  dlp::append(bytes, static_cast<std::uint32_t>(entry.bit) << 11U, 2);  // bits 10:0 are not for video
  return bytes;
}

std::vector<TableEntry> video_table(const dlp::Sequence& sequence) {
  std::vector<TableEntry> table(static_cast<std::size_t>(sequence.planes));
  for (int k = 0; k < sequence.planes; ++k) {
    TableEntry& entry = table[static_cast<std::size_t>(k)];
    entry.index = k;
    entry.exposure_us = sequence.exposure_us;
    entry.dark_us = sequence.period_us - sequence.exposure_us;
    entry.leds = sequence.leds;
    entry.waits = k == 0;
    entry.clears = k + 1 == sequence.planes;
    entry.bit = k;
  }
  return table;
}

std::optional<Mirrors> mirrors_of(std::uint8_t type) {
  static constexpr std::array<std::pair<std::uint8_t, Mirrors>, 5> kTypes{{{1, {"DLP6500", {1080, 1920}}},
                                                                           {2, {"DLP9000", {1600, 2560}}},
                                                                           {3, {"DLP670S", {1600, 2716}}},
                                                                           {4, {"DLP500YX", {1200, 2048}}},
                                                                           {5, {"DLP5500", {768, 1024}}}}};
  for (const auto& [number, mirrors] : kTypes)
    if (number == type) return mirrors;
  return std::nullopt;
}

Result<std::int16_t> delay_us(Nanoseconds delay) {
  constexpr long kLeast = -20, kMost = 20'000;
  const long us = std::lround(1e-3 * static_cast<double>(delay.count()));
  if (us >= kLeast && us <= kMost) return static_cast<std::int16_t>(us);
  return Error{ErrorCode::bad_argument, fmt::format("a trigger output cannot be delayed by {} us", us),
               fmt::format("give {} us to {} us", kLeast, kMost)};
}

namespace {

using dlp::Bytes;
using dlp::Command;

constexpr std::size_t kTimingBytes = 18, kTriggerBytes = 5, kCountBytes = 6;

Command trigger_command(int number) {
  return number == 1 ? Command::trigger_out_1 : Command::trigger_out_2;
}

}  // namespace

std::string_view name_of(ControllerMode mode) {
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

Result<ControllerMode> Controller::display_mode() {
  SYMRIG_TRY(const std::uint8_t mode, byte(Command::display_mode));
  return static_cast<ControllerMode>(mode & 3U);
}

Result<void> Controller::set_display_mode(ControllerMode mode) {
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

/// The flag of an abort stays after each stop, so it tells nothing about the controller's health.
Result<void> look(Controller& controller, DlpController& found) {
  SYMRIG_CHECK(dlp::look_at_common(controller, found));
  SYMRIG_TRY(const std::uint8_t type, controller.mirrors());
  if (const auto mirrors = mirrors_of(type)) found.mirrors = mirrors->name;
  SYMRIG_TRY(const dlp::Status status, controller.status());
  found.healthy = status.initialized() && !status.sequencer_error();
  SYMRIG_TRY(const ControllerMode mode, controller.display_mode());
  found.patterns = mode != ControllerMode::video;
  found.running = found.patterns && status.sequencing();
  SYMRIG_TRY(const dlp::Signal signal, controller.signal());
  found.signal = dlp::described(signal);
  return {};
}

}  // namespace symrig::projector::dlpc900
