// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"

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
