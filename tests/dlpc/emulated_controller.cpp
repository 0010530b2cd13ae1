// SPDX-License-Identifier: Apache-2.0
#include "dlpc/emulated_controller.hpp"

#include <algorithm>

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

}  // namespace symrig::test
