// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::base {

/// A two-way byte stream on a non-blocking descriptor. name: as the user gave it, for messages.
class ByteStream {
 public:
  ByteStream(Fd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}

  /// Sends all bytes, in as many pieces as the system requires.
  /// fails: device_lost (closed, or no byte accepted for `patience`).
  Result<void> send(std::span<const std::uint8_t> bytes, Nanoseconds patience) const;
  /// Returns the bytes that arrive within `timeout`, at most 4096; empty if none came. A signal does not
  /// shorten the wait.
  /// fails: device_lost (closed).
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) const;

  const std::string& name() const { return name_; }

 private:
  Result<bool> wait(short events, Nanoseconds timeout) const;

  Fd fd_;
  std::string name_;
};

}  // namespace symrig::base

namespace symrig {

/// The termios code of a baud rate.  fails: bad_argument (there is no such rate; the hint is the next one
/// above).
Result<std::uint32_t> serial_speed(std::uint32_t baud);

/// Makes a serial line raw: every byte passes unchanged, 8 bits, no flow control. speed: of serial_speed().
/// errno says why where it is false: the descriptor is no serial port, or the port refuses the speed.
bool make_raw_line(int descriptor, std::uint32_t speed);

}  // namespace symrig
