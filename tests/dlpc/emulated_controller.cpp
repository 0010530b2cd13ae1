// SPDX-License-Identifier: Apache-2.0

#include "dlpc/emulated_controller.hpp"

#include <algorithm>
#include <set>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::test {

std::uint32_t number_at(const EmulatedController::Bytes& bytes, std::size_t at, unsigned count) {
  std::uint32_t value = 0;
  for (unsigned k = 0; k < count; ++k) value |= std::uint32_t{bytes[at + k]} << (8 * k);
  return value;
}

void put_number(EmulatedController::Bytes& bytes, std::size_t at, unsigned count, std::uint32_t value) {
  for (unsigned k = 0; k < count; ++k) bytes[at + k] = static_cast<std::uint8_t>(value >> (8 * k));
}

std::optional<EmulatedController::Bytes> EmulatedController::read_setting(unsigned command) const {
  const auto found = settings_.find(command);
  if (found == settings_.end()) return std::nullopt;
  return found->second;
}

bool EmulatedController::write_setting(unsigned command, const Bytes& data) {
  const auto found = settings_.find(command);
  if (found == settings_.end() || found->second.size() != data.size()) return false;
  found->second = data;
  return true;
}

std::string EmulatedController::settings_text() const {
  std::string text;
  for (const auto& [command, value] : settings_) text += fmt::format("{:04x}: {}\n", command, value);
  return text;
}

void EmulatedController::answer(std::uint8_t flags, std::uint8_t number, const Bytes& data, bool refused) {
  Bytes bytes((4 + data.size() + 63) / 64 * 64);
  bytes[0] = static_cast<std::uint8_t>((flags & 0xC0) | (refused ? 0x20 : 0));
  bytes[1] = number;
  put_number(bytes, 2, 2, static_cast<std::uint32_t>(data.size()));
  std::copy(data.begin(), data.end(), bytes.begin() + 4);
  auto& queue = late > 0 ? held_ : out_;
  for (std::size_t at = 0; at < bytes.size(); at += 64) {
    Report report{};
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), 64, report.begin());
    queue.push_back(report);
  }
  late -= late > 0;
}

bool EmulatedController::took_refusal(unsigned command) {
  const auto found = refuse.find(command);
  if (found == refuse.end() || found->second == 0) return false;
  --found->second;
  return true;
}

void EmulatedController::run(std::uint8_t flags, std::uint8_t number, unsigned command, const Bytes& data) {
  commands_.push_back(command);
  if (reset_after && (*reset_after)-- == 0) {
    reset_after.reset();
    reset();
  }
  if (stalled > 0) {
    --stalled;
    return;
  }
  if (took_refusal(command)) return answer(flags, number, {}, true);
  if ((flags & 0x80) != 0) {
    const auto value = read(command);
    return answer(flags, number, value.value_or(Bytes{}), !value);
  }
  const bool taken = write(command, data);
  if ((flags & 0x40) != 0) answer(flags, number, {}, !taken);
}

bool EmulatedController::report(const Report& report) {
  if (unplugged_after && (*unplugged_after)-- == 0) gone_ = true;
  if (gone_) return false;
  out_.insert(out_.end(), held_.begin(), held_.end());
  held_.clear();
  message_.insert(message_.end(), report.begin(), report.end());
  const std::size_t length = 4 + message_[2] + std::size_t{message_[3]} * 256;
  if (message_.size() < length) return true;
  const Bytes body(message_.begin() + 6, message_.begin() + static_cast<std::ptrdiff_t>(length));
  const unsigned command = message_[5] * 256U + message_[4];
  const std::uint8_t flags = message_[0], number = message_[1];
  message_.clear();
  run(flags, number, command, body);
  return true;
}

std::optional<EmulatedController::Report> EmulatedController::next() {
  if (out_.empty()) return std::nullopt;
  const Report report = out_.front();
  out_.pop_front();
  return report;
}

Result<void> EmulatedTransport::write(const projector::dlp::Report& report) {
  if (device_->report(report)) return {};
  return Error{ErrorCode::device_lost, name() + " is gone", "check its USB cable"};
}

Result<projector::dlp::Report> EmulatedTransport::read(Nanoseconds /*patience*/) {
  if (device_->gone()) return Error{ErrorCode::device_lost, name() + " is gone", "check its USB cable"};
  if (auto report = device_->next()) return *report;
  return Error{ErrorCode::timeout, name() + " sent no report", ""};
}

namespace {

using Bytes = EmulatedController::Bytes;

/// The settings that a sequence consists of. After a change of one, the controller must check it again.
const std::set<unsigned> kOfSequence{0x1A1D, 0x1A1E, 0x1A22, 0x1A23, 0x1A29, 0x1A30, 0x1A31, 0x1A34};

}  // namespace

EmulatedDlpc350::EmulatedDlpc350() {
  columns = 912;
  rows = 1140;
  EmulatedDlpc350::reset();
}

void EmulatedDlpc350::reset() {
  settings_ = {{0x0B01, {0x97, 0x78, 0x7D}},
               {0x1A00, {0x00}},
               {0x1A07, {0x08}},
               {0x1A1B, {0x00}},
               {0x1A1D, {0x00, 0xBB, 0xBB}},
               {0x1A1E, {0x00, 0xBB}},
               {0x1A22, {0x03}},
               {0x1A23, {0x01}},
               {0x1A24, {0x00}},
               {0x1A29, {0x20, 0xA1, 0x07, 0x00, 0x20, 0xA1, 0x07, 0x00}},
               {0x1A30, {0x00}},
               {0x1A31, {0x01, 0x00, 0x01, 0x00}}};
  table_.assign(128, {0x00, 0x71, 0x00});
  open_table_ = address_ = 0;
  checked_.reset();
}

std::string EmulatedDlpc350::state() const {
  std::string text = settings_text();
  const std::size_t used = settings_.at(0x1A31)[0] + std::size_t{1};
  for (std::size_t k = 0; k < used; ++k) text += fmt::format("{}: {}\n", k, table_[k]);
  return text;
}

EmulatedController::SequenceShown EmulatedDlpc350::sequence() const {
  const Bytes& times = settings_.at(0x1A29);
  SequenceShown shown{{},
                      number_at(times, 0, 4),
                      number_at(times, 4, 4),
                      0.1072 * (settings_.at(0x1A1D)[1] - settings_.at(0x1A1E)[1])};
  const std::size_t entries = settings_.at(0x1A31)[0] + std::size_t{1};
  for (std::size_t k = 0; k < entries; ++k) shown.patterns.push_back(table_[k][0] >> 2);
  return shown;
}

/// Its own check (DLPU010, "Validation Command"): bit 0 times, bit 1 pattern numbers, bits 2 to 4 warnings.
std::uint8_t EmulatedDlpc350::check() const {
  constexpr std::array<std::uint32_t, 8> kLeast{235, 700, 1570, 1700, 2000, 2500, 4500, 8333};
  const Bytes& times = settings_.at(0x1A29);
  const std::uint32_t exposure = number_at(times, 0, 4), period = number_at(times, 4, 4);
  const std::size_t entries = settings_.at(0x1A31)[0] + std::size_t{1};
  std::uint8_t result = 0;
  if (exposure != period && period < exposure + 230) result |= 0x11;
  for (std::size_t k = 0; k < entries; ++k) {
    const int bits = table_[k][1] & 0xF, pattern = table_[k][0] >> 2;
    if (bits < 1 || bits > 8) {
      result |= 2;
      continue;
    }
    if (exposure < kLeast[static_cast<std::size_t>(bits - 1)]) result |= 1;
    if (pattern > 24 / bits) result |= 2;
    if ((table_[k][2] & 8) != 0) result |= 4;
  }
  return result;
}

Bytes EmulatedDlpc350::signal_bytes() const {
  Bytes bytes(28);
  bytes[0] = signal ? 2 : 0;
  put_number(bytes, 1, 2, static_cast<std::uint32_t>(columns));
  put_number(bytes, 3, 2, static_cast<std::uint32_t>(rows));
  put_number(bytes, 14, 2, static_cast<std::uint32_t>(hertz * hertz_unit));
  put_number(bytes, 16, 2, static_cast<std::uint32_t>(columns + 160));
  put_number(bytes, 18, 2, static_cast<std::uint32_t>(rows + 31));
  put_number(bytes, 20, 2, static_cast<std::uint32_t>(columns));
  put_number(bytes, 22, 2, static_cast<std::uint32_t>(rows));
  return bytes;
}

std::optional<Bytes> EmulatedDlpc350::read(unsigned command) {
  switch (command) {
    case 0x0200:
      return Bytes{std::uint8_t{standby}};
    case 0x0205: {
      Bytes bytes(16);
      bytes[3] = 3;
      bytes[2] = 1;
      return bytes;
    }
    case 0x071C:
      return signal_bytes();
    case 0x1A0A:
      return Bytes{static_cast<std::uint8_t>(sequencer_fault ? 0x81 : 0x01)};
    case 0x1A0B:
      return Bytes{1};
    case 0x1A0C:
      return Bytes{static_cast<std::uint8_t>(running() == 2 ? 2 : 0)};
    case 0x1A1A:
      if (not_ready_ > 0) {
        --not_ready_;
        return Bytes{0x80};
      }
      return Bytes{checked_.value_or(0x80)};
    case 0x1A34:
      return open_table_ == 2 ? std::optional(table_bytes()) : std::nullopt;
    default:
      return read_setting(command);
  }
}

/// The used entries from the address on.
Bytes EmulatedDlpc350::table_bytes() const {
  Bytes bytes;
  const std::size_t entries = settings_.at(0x1A31)[0] + std::size_t{1};
  for (std::size_t k = address_; k < entries; ++k)
    bytes.insert(bytes.end(), table_[k].begin(), table_[k].end());
  return bytes;
}

bool EmulatedDlpc350::write_table(const Bytes& data) {
  if (open_table_ != 2 || data.size() % 3 != 0 || address_ + data.size() / 3 > table_.size()) return false;
  for (std::size_t k = 0; k < data.size() / 3; ++k) {
    auto& entry = table_[address_ + k];
    std::copy_n(data.begin() + static_cast<std::ptrdiff_t>(3 * k), 3, entry.begin());
    if (bad_entry == address_ + k) entry[0] = static_cast<std::uint8_t>(entry[0] ^ 4U);
  }
  return true;
}

/// false: refused. A sequence is changed only while it stands, and started only after its check.
bool EmulatedDlpc350::write(unsigned command, const Bytes& data) {
  if (kOfSequence.contains(command) && running() != 0) return false;
  if (kOfSequence.contains(command)) checked_.reset();
  switch (command) {
    case 0x1A1A:
      not_ready_ = slow_check;
      checked_ = check();
      return true;
    case 0x1A24:
      if (data[0] > 2) return false;
      if (data[0] == 2 && (!shows_patterns() || !checked_ || (*checked_ & 3) != 0)) return false;
      started_ += data[0] == 2 && running() != 2;
      break;
    case 0x1A32:
      address_ = data[0];
      return true;
    case 0x1A33:
      open_table_ = data[0];
      return data[0] <= 2;
    case 0x1A34:
      return write_table(data);
    default:
      break;
  }
  return write_setting(command, data);
}

}  // namespace symrig::test
