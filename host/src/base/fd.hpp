// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace symrig::base {

/// A file descriptor that closes itself.
class Fd {
 public:
  Fd() = default;
  explicit Fd(int fd) : fd_(fd) {}
  Fd(Fd&& other) noexcept;
  Fd& operator=(Fd&& other) noexcept;
  ~Fd();

  int get() const { return fd_; }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

/// Time on the host's steady clock (CLOCK_MONOTONIC), the clock of every link to a real board.
Nanoseconds steady_now();

/// A two-way pipe of bytes behind a non-blocking descriptor. name: for messages, as the user gave it.
class ByteStream {
 public:
  ByteStream(Fd fd, std::string name) : fd_(std::move(fd)), name_(std::move(name)) {}

  /// Sends all bytes, in as many pieces as the system takes. fails: device_lost (closed, or nothing taken for
  /// `patience`).
  Result<void> send(std::span<const std::uint8_t> bytes, Nanoseconds patience) const;
  /// What is there within `timeout`, at most 4096 bytes; empty if nothing came. A signal does not cut the
  /// wait short. fails: device_lost (closed).
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) const;

  const std::string& name() const { return name_; }

 private:
  Result<bool> wait(short events, Nanoseconds timeout) const;

  Fd fd_;
  std::string name_;
};

}  // namespace symrig::base
