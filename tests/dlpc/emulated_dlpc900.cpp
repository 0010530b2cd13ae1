// SPDX-License-Identifier: Apache-2.0
#include "dlpc/emulated_controller.hpp"

#include <algorithm>
#include <numeric>

namespace symrig::test {
namespace {

using Bytes = EmulatedController::Bytes;

constexpr unsigned kMost = 400;        // entries of the table
constexpr std::uint32_t kLeast = 105;  // us, of a 1-bit pattern

int signed_half(const Bytes& bytes, std::size_t at) {
  return static_cast<std::int16_t>(number_at(bytes, at, 2));
}

/// -20 us to 20,000 us; an output that is not inverted must not rise after it falls.
bool is_trigger(const Bytes& data) {
  if (data.size() != 5) return false;
  const int rising = signed_half(data, 1), falling = signed_half(data, 3);
  const auto legal = [](int delay) { return delay >= -20 && delay <= 20'000; };
  return legal(rising) && legal(falling) && rising <= falling;
}

}  // namespace

EmulatedDlpc900::EmulatedDlpc900() {
  columns = 1920;
  rows = 1080;
  EmulatedDlpc900::reset();
}

/// The values of DLPU018J, appendix A. The mode of a LightCrafter's firmware is video.
void EmulatedDlpc900::reset() {
  settings_ = {{0x0B01, {0x97, 0x78, 0x7D}},
               {0x1A00, {0x08}},
               {0x1A01, {0x00}},
               {0x1A07, {0x08}},
               {0x1A1B, {0x00}},
               {0x1A1D, {0x00, 0x00, 0x00, 0x00, 0x00}},
               {0x1A1E, {0x00, 0x00, 0x00, 0x00, 0x00}},
               {0x1A31, {0x00, 0x00, 0x00, 0x00, 0x00, 0x00}}};
  table_.assign(kMost, {});
  effective_.clear();
  running_ = broken_off_ = aborted_ = false;
  mode_reads_ = start_reads_ = 0;
}

void EmulatedDlpc900::start_stored_patterns() {
  settings_[0x1A1B] = {1};
  settings_[0x1A31] = {3, 0, 0, 0, 0, 0};
  running_ = true;
}

std::string EmulatedDlpc900::state() const {
  return settings_text().substr(0, settings_text().find("1a31"));
}

EmulatedController::SequenceShown EmulatedDlpc900::sequence() const {
  SequenceShown shown;
  for (const Entry& entry : effective_) {
    const Bytes bytes(entry.begin(), entry.end());
    shown.patterns.push_back(static_cast<int>(number_at(bytes, 10, 2) >> 11));
    shown.exposure_us = number_at(bytes, 2, 3);
    shown.period_us = shown.exposure_us + number_at(bytes, 6, 3);
  }
  shown.frames_all = true;
  shown.frame_lead_us = signed_half(settings_.at(0x1A1E), 1) - signed_half(settings_.at(0x1A1D), 1);
  return shown;
}

bool EmulatedDlpc900::is_locked() const {
  return signal && settings_.at(0x1A01)[0] != 0 && settings_.at(0x1A00)[0] == 0x08 &&
         !(loses_lock && mode() == 2);
}

/// All patterns and the black before the next VSYNC end within a refresh.
bool EmulatedDlpc900::fits() const {
  std::uint32_t sum = kLeast;
  for (const Entry& entry : effective_) {
    const Bytes bytes(entry.begin(), entry.end());
    sum += number_at(bytes, 2, 3) + number_at(bytes, 6, 3);
  }
  return sum < 1'000'000U / static_cast<unsigned>(hertz);
}

Bytes EmulatedDlpc900::status(unsigned command) {
  if (command == 0x1A0A)
    return {static_cast<std::uint8_t>(0x01 | (aborted_ ? 0x40 : 0) |
                                      (broken_off_ || sequencer_fault ? 0x80 : 0))};
  if (command == 0x1A0B) return {1};
  const bool starting = start_reads_ > 0;
  start_reads_ -= starting;
  return {static_cast<std::uint8_t>((running_ && !starting ? 0x02 : 0) | (is_locked() ? 0x08 : 0) |
                                    (signal ? 0x10 : 0))};
}

Bytes EmulatedDlpc900::timing() const {
  Bytes bytes(18);
  const std::uint32_t line = static_cast<std::uint32_t>(columns) + 280,
                      lines = static_cast<std::uint32_t>(rows) + 45;
  put_number(bytes, 0, 2, line);
  put_number(bytes, 2, 2, lines);
  put_number(bytes, 4, 2, static_cast<std::uint32_t>(columns));
  put_number(bytes, 6, 2, static_cast<std::uint32_t>(rows));
  put_number(bytes, 14, 4, line * lines * static_cast<std::uint32_t>(hertz) / 1000);
  return bytes;
}

std::optional<Bytes> EmulatedDlpc900::read(unsigned command) {
  switch (command) {
    case 0x0200:
      return Bytes{std::uint8_t{standby}};
    case 0x0205: {
      Bytes bytes(16);
      bytes[3] = 6;
      bytes[0] = 1;
      return bytes;
    }
    case 0x0206: {
      Bytes bytes(32);
      bytes[0] = static_cast<std::uint8_t>(mirrors);
      return bytes;
    }
    case 0x1A0A:
    case 0x1A0B:
    case 0x1A0C:
      return status(command);
    case 0x1A1B:
      if (mode_reads_ == 0) return read_setting(command);
      --mode_reads_;
      return Bytes{static_cast<std::uint8_t>(mode_before_)};
    case 0x1A3C:
      return timing();
    default:
      return read_setting(command);  // the table and start/stop are not among them
  }
}

/// Video patterns come only after video mode, with a signal that is locked.
bool EmulatedDlpc900::write_mode(const Bytes& data) {
  if (data.size() != 1 || data[0] > 3 || running_) return false;
  if (data[0] == 2 && mode() != 2 && (mode() != 0 || !is_locked())) return false;
  mode_before_ = mode();
  mode_reads_ = data[0] == mode() ? 0 : slow_mode;
  return write_setting(0x1A1B, data);
}

bool EmulatedDlpc900::write_run(std::uint8_t run) {
  if (mode() == 0 || run > 2) return false;
  if (run == 2) {
    if (effective_.empty()) return false;
    started_ += !running_;
    broken_off_ = mode() == 2 && !fits();
    start_reads_ = slow_start;
  }
  aborted_ = aborted_ || run != 2;  // the flag stays after a stop
  running_ = run == 2;
  if (!running_) broken_off_ = false;
  return true;
}

bool EmulatedDlpc900::write_entry(const Bytes& data) {
  if (mode() == 0 || running_ || data.size() != 12) return false;
  const std::uint32_t index = number_at(data, 0, 2);
  if (index >= kMost || number_at(data, 2, 3) < kLeast || number_at(data, 10, 2) >> 11 > 23) return false;
  std::copy_n(data.begin(), 12, table_[index].begin());
  if (bad_entry == index) table_[index][11] = static_cast<std::uint8_t>(table_[index][11] ^ 8U);
  return true;
}

bool EmulatedDlpc900::write_counts(const Bytes& data) {
  if (running_ || data.size() != 6) return false;
  const std::uint32_t entries = number_at(data, 0, 2);
  if (entries < 1 || entries > kMost) return false;
  effective_.assign(table_.begin(), table_.begin() + static_cast<std::ptrdiff_t>(entries));
  return write_setting(0x1A31, data);
}

bool EmulatedDlpc900::write(unsigned command, const Bytes& data) {
  switch (command) {
    case 0x1A1B:
      return write_mode(data);
    case 0x1A1D:
    case 0x1A1E:
      return !running_ && is_trigger(data) && write_setting(command, data);
    case 0x1A24:
      return data.size() == 1 && write_run(data[0]);
    case 0x1A31:
      return write_counts(data);
    case 0x1A34:
      return write_entry(data);
    default:
      return write_setting(command, data);
  }
}

}  // namespace symrig::test
