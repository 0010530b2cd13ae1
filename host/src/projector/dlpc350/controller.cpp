// SPDX-License-Identifier: Apache-2.0

#include "symrig/projector/internal/dlp.hpp"
#include "symrig/projector/internal/dlpc350.hpp"

#include <chrono>
#include <thread>

#include <fmt/format.h>

namespace symrig::projector::dlpc350 {
namespace {

using dlp::append;
using dlp::Bytes;
using dlp::Command;
using dlp::half;
using dlp::word;

constexpr std::size_t kSignalBytes = 28;
/// The controller checks a sequence in less than 0.1 s as a rule. Then it is asked this often.
constexpr int kValidationPolls = 100;
constexpr std::chrono::milliseconds kValidationPause{10};
constexpr std::uint8_t kPatternTable = 2, kCloseTable = 0;

/// The unit of the signal's frequency was not checked. Sources have 20 to 200 Hz, so the size of the number
/// tells the unit: 1, 0.1 or 0.01 Hz.
double refresh_of(std::uint16_t frequency) {
  for (const double unit : {1.0, 0.1, 0.01})
    if (const double hz = unit * frequency; hz >= 20 && hz < 200) return hz;
  return 0;
}

}  // namespace

std::string to_string(Validation validation) {
  std::string text;
  const auto add = [&text](bool present, std::string_view what) {
    if (present) text += (text.empty() ? "" : ", ") + std::string(what);
  };
  add(validation.bad_times(), "exposure or period not valid");
  add(validation.bad_patterns(), "a pattern number not valid");
  add(validation.joined_triggers(), "TRIG_OUT_1 does not fall between patterns");
  add(validation.no_black(), "no black before a triggered pattern");
  add(validation.short_load(), "less than 230 us between exposure and period");
  return text.empty() ? "valid" : text;
}

Result<dlp::Signal> Controller::signal() {
  SYMRIG_TRY(const Bytes data, dialogue().read(Command::signal, kSignalBytes));
  constexpr std::uint8_t kLockMask = 3, kLocked = 2;
  dlp::Signal signal;
  signal.locked = (data[0] & kLockMask) == kLocked;
  signal.cols = half(data, 20);
  signal.rows = half(data, 22);
  signal.refresh_hz = refresh_of(half(data, 14));
  return signal;
}

Result<bool> Controller::shows_patterns() {
  SYMRIG_TRY(const std::uint8_t mode, byte(Command::display_mode));
  return mode != 0;
}

Result<void> Controller::show_patterns(bool patterns) {
  return dialogue().write(Command::display_mode, patterns ? 1 : 0);
}

Result<std::uint8_t> Controller::pattern_source() {
  return byte(Command::pattern_source);
}

Result<void> Controller::set_pattern_source(std::uint8_t source) {
  return dialogue().write(Command::pattern_source, source);
}

Result<std::uint8_t> Controller::trigger_mode() {
  return byte(Command::trigger_mode);
}

Result<void> Controller::set_trigger_mode(std::uint8_t mode) {
  return dialogue().write(Command::trigger_mode, mode);
}

Result<Times> Controller::times() {
  SYMRIG_TRY(const Bytes data, dialogue().read(Command::exposure, 8));
  return Times{word(data, 0), word(data, 4)};
}

Result<void> Controller::set_times(Times times) {
  Bytes data;
  append(data, times.exposure_us, 4);
  append(data, times.period_us, 4);
  return dialogue().write(Command::exposure, data);
}

Result<Counts> Controller::counts() {
  SYMRIG_TRY(const Bytes data, dialogue().read(Command::pattern_count, 4));
  return Counts{data[0] + 1, data[1] != 0, data[2] + 1, data[3] + 1};
}

Result<void> Controller::set_counts(const Counts& counts) {
  const Bytes data{static_cast<std::uint8_t>(counts.entries - 1), static_cast<std::uint8_t>(counts.repeats),
                   static_cast<std::uint8_t>(counts.patterns_a_trigger - 1),
                   static_cast<std::uint8_t>(counts.images - 1)};
  return dialogue().write(Command::pattern_count, data);
}

/// One lost answer must not leave the table open.
Result<void> Controller::close_table() {
  const auto closed = dialogue().write(Command::table_open, kCloseTable);
  return closed ? closed : dialogue().write(Command::table_open, kCloseTable);
}

/// Whatever happens between, the table is closed again: an open one keeps the controller from its work.
Result<std::vector<TableEntry>> Controller::table(int entries) {
  const std::size_t bytes = kEntryBytes * static_cast<std::size_t>(entries);
  SYMRIG_CHECK(dialogue().write(Command::table_open, kPatternTable));
  auto data = [&]() -> Result<Bytes> {
    SYMRIG_CHECK(dialogue().write(Command::table_address, 0));
    return dialogue().read(Command::table_data, bytes);
  }();
  const auto closed = close_table();
  if (!data) return std::move(data).error();
  if (!closed) return closed.error();
  std::vector<TableEntry> table;
  for (std::size_t at = 0; at < bytes; at += kEntryBytes)
    table.push_back(entry_of(std::span<const std::uint8_t, kEntryBytes>(data->data() + at, kEntryBytes)));
  return table;
}

Result<void> Controller::set_table(const std::vector<TableEntry>& entries) {
  Bytes data;
  for (const TableEntry& entry : entries)
    for (const std::uint8_t byte : to_bytes(entry)) data.push_back(byte);
  SYMRIG_CHECK(dialogue().write(Command::table_open, kPatternTable));
  auto written = [&]() -> Result<void> {
    SYMRIG_CHECK(dialogue().write(Command::table_address, 0));
    return dialogue().write(Command::table_data, data);
  }();
  auto closed = close_table();
  return written ? closed : written;
}

Result<bool> Controller::inverted() {
  SYMRIG_TRY(const std::uint8_t inverted, byte(Command::invert));
  return inverted != 0;
}

Result<void> Controller::set_inverted(bool inverted) {
  return dialogue().write(Command::invert, inverted ? 1 : 0);
}

Result<TriggerOut> Controller::trigger_out(int number) {
  const bool first = number == 1;
  SYMRIG_TRY(const Bytes data,
             dialogue().read(first ? Command::trigger_out_1 : Command::trigger_out_2, first ? 3 : 2));
  TriggerOut out{data[0] != 0, data[1]};
  if (first) out.falling = data[2];
  return out;
}

Result<void> Controller::set_trigger_out(int number, const TriggerOut& out) {
  const std::array data{static_cast<std::uint8_t>(out.inverted), out.rising, out.falling};
  if (number == 1) return dialogue().write(Command::trigger_out_1, data);
  return dialogue().write(Command::trigger_out_2, std::span(data).first(2));
}

Result<dlp::Run> Controller::run() {
  SYMRIG_TRY(const std::uint8_t run, byte(Command::run));
  return static_cast<dlp::Run>(run & 3U);
}

Result<Validation> Controller::validate() {
  SYMRIG_CHECK(dialogue().write(Command::validate, 0));
  constexpr std::uint8_t kNotReady = 0x80;
  for (int poll = 0; poll < kValidationPolls; ++poll) {
    SYMRIG_TRY(const std::uint8_t bits, byte(Command::validate));
    if ((bits & kNotReady) == 0) return Validation{bits};
    std::this_thread::sleep_for(kValidationPause);
  }
  return Error{ErrorCode::timeout, name() + " did not end the check of its sequence",
               "disconnect its power, and connect it again"};
}

Result<void> look(Controller& controller, DlpController& found) {
  SYMRIG_CHECK(dlp::look_at_common(controller, found));
  SYMRIG_TRY(found.patterns, controller.shows_patterns());
  SYMRIG_TRY(const dlp::Run run, controller.run());
  found.running = found.patterns && run == dlp::Run::start;
  SYMRIG_TRY(const dlp::Signal signal, controller.signal());
  found.signal = dlp::described(signal);
  return {};
}

}  // namespace symrig::projector::dlpc350
