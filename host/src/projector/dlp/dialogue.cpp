// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/dialogue.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

/// Late replies that are dropped before a command counts as unanswered.
constexpr int kLateReplies = 16;

std::string command_text(Command command) {
  return fmt::format("command {:#06x}", static_cast<unsigned>(command));
}

}  // namespace

std::vector<Report> message_reports(std::uint8_t flags, std::uint8_t number,
                                    std::span<const std::uint8_t> body) {
  const std::size_t length = kHeadBytes + body.size();
  std::vector<Report> reports((length + kReportBytes - 1) / kReportBytes);
  reports[0] = {flags, number, static_cast<std::uint8_t>(body.size()),
                static_cast<std::uint8_t>(body.size() >> 8U)};
  for (std::size_t i = kHeadBytes; i < length; ++i)
    reports[i / kReportBytes][i % kReportBytes] = body[i - kHeadBytes];
  return reports;
}

Bytes command_body(Command command, std::span<const std::uint8_t> data) {
  const auto code = static_cast<std::uint16_t>(command);
  Bytes body(2 + data.size());
  body[0] = static_cast<std::uint8_t>(code);
  body[1] = static_cast<std::uint8_t>(code >> 8U);
  std::ranges::copy(data, body.begin() + 2);
  return body;
}

Dialogue::Dialogue(std::unique_ptr<HidTransport> transport, int firmware, Nanoseconds patience)
    : transport_(std::move(transport)), firmware_(firmware), patience_(patience) {}

std::string Dialogue::other_firmware() const {
  return fmt::format("update its firmware; symrig was written for version {}", firmware_);
}

Result<Bytes> Dialogue::read(Command command, std::size_t least) {
  SYMRIG_TRY(Reply got, exchange(kRead | kReplyAsked, command, {}));
  if (got.refused)
    return Error{ErrorCode::device_refused,
                 fmt::format("{} refused to read {}", name(), command_text(command)), other_firmware()};
  if (got.data.size() < least)
    return Error{ErrorCode::protocol,
                 fmt::format("{} answered {} with {} bytes instead of {}", name(), command_text(command),
                             got.data.size(), least),
                 other_firmware()};
  return std::move(got.data);
}

Result<void> Dialogue::write(Command command, std::span<const std::uint8_t> data) {
  SYMRIG_TRY(const Reply got, exchange(kReplyAsked, command, data));
  if (!got.refused) return {};
  return Error{ErrorCode::device_refused, fmt::format("{} refused {}", name(), command_text(command)),
               "check its video source and its settings"};
}

Result<Dialogue::Reply> Dialogue::exchange(std::uint8_t flags, Command command,
                                           std::span<const std::uint8_t> data) {
  ++number_;
  for (const Report& report : message_reports(flags, number_, command_body(command, data)))
    SYMRIG_CHECK(transport_->write(report));
  return reply(command);
}

Error Dialogue::silent(Command command) const {
  return {ErrorCode::timeout, fmt::format("{} did not answer {}", name(), command_text(command)),
          "disconnect its USB cable and its power, and connect them again"};
}

Result<Dialogue::Reply> Dialogue::reply(Command command) {
  for (int late = 0; late < kLateReplies; ++late) {
    auto first = transport_->read(patience_);
    if (!first) return first.error().code == ErrorCode::timeout ? silent(command) : first.error();
    const Report& head = *first;
    const std::size_t length = head[2] | std::size_t{head[3]} << 8U;
    Reply got{(head[0] & kRefused) != 0, {}};
    got.data.assign(head.begin() + kHeadBytes,
                    head.begin() + kHeadBytes + std::min(length, kReportBytes - kHeadBytes));
    while (got.data.size() < length) {
      auto more = transport_->read(patience_);
      if (!more) return more.error().code == ErrorCode::timeout ? silent(command) : more.error();
      got.data.insert(got.data.end(), more->begin(),
                      more->begin() + std::min(kReportBytes, length - got.data.size()));
    }
    if (head[1] == number_) return got;
  }
  return silent(command);
}

}  // namespace symrig::projector::dlp
