// SPDX-License-Identifier: Apache-2.0
#include "board/links/virtual_connection.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kHello = 5s;      // for the first answer: whether a board is there at all
constexpr Nanoseconds kPatience = 15s;  // for an answer that needs no time of the board
constexpr Nanoseconds kMost = 120s;
constexpr std::int64_t kSlowness = 300;  // real seconds for one second of an emulated board, at most
constexpr std::size_t kHeader = 5;
constexpr std::size_t kMaxPayload = std::size_t{1} << 26;

Nanoseconds patience_for(Nanoseconds board_time) {
  return std::min(kPatience + kSlowness * std::min(board_time, kMost), kMost);
}

}  // namespace

Error VirtualBench::Connection::silence(Nanoseconds patience) const {
  return {ErrorCode::device_lost,
          fmt::format("{}: no answer for {} s", stream_.name(), patience / Nanoseconds{1s}),
          "check the virtual board's server"};
}

/// Reads until `count` bytes are in the buffer.
Result<void> VirtualBench::Connection::fill(std::size_t count, Nanoseconds patience) {
  while (waiting_.size() < count) {
    SYMRIG_TRY(const auto bytes, stream_.receive(patience));
    silent_ = bytes.empty();
    if (silent_) return silence(patience);
    waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  }
  return {};
}

Result<std::vector<std::uint8_t>> VirtualBench::Connection::ask(char type,
                                                                std::span<const std::uint8_t> payload,
                                                                std::size_t least, Nanoseconds board_time) {
  const Nanoseconds patience = type == 'h' ? kHello : patience_for(board_time);
  if (silent_) return silence(patience);
  board::Packer packer;
  packer.put(type).put(static_cast<std::uint32_t>(payload.size()));
  std::vector<std::uint8_t> message(packer.bytes().begin(), packer.bytes().end());
  message.insert(message.end(), payload.begin(), payload.end());
  SYMRIG_CHECK(stream_.send(message, patience));

  SYMRIG_CHECK(fill(kHeader, patience));
  const char kind = static_cast<char>(waiting_[0]);
  const std::size_t size = board::unpack<std::uint32_t>(waiting_, 1);
  if ((kind != type && kind != 'x') || size > kMaxPayload || (kind == type && size < least))
    return Error{ErrorCode::protocol,
                 fmt::format("{}: the answer to '{}' is not valid", stream_.name(), type),
                 "check that the server is a virtual board of this version"};
  SYMRIG_CHECK(fill(kHeader + size, patience));
  const auto begin = waiting_.begin() + kHeader;
  std::vector<std::uint8_t> answer(begin, begin + static_cast<std::ptrdiff_t>(size));
  waiting_.erase(waiting_.begin(), begin + static_cast<std::ptrdiff_t>(size));
  if (kind == type) return answer;
  return Error{ErrorCode::device_lost,
               fmt::format("{}: {}", stream_.name(), std::string(answer.begin(), answer.end())),
               "the virtual board cannot do that"};
}

Result<void> VirtualBench::Connection::tell(char type, std::span<const std::uint8_t> payload,
                                            Nanoseconds board_time) {
  SYMRIG_CHECK(ask(type, payload, 0, board_time));
  return {};
}

}  // namespace symrig
