// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/hal/edge_engine.hpp"
#include "symrig/hal/peripherals.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include <fcntl.h>
#include <unistd.h>

namespace symrig::board_linux {

/// The board's lines, numbered as on the wire: bit k of a word is line k.
class Gpio {
 public:
  Gpio() = default;
  Gpio(const Gpio&) = delete;
  Gpio& operator=(const Gpio&) = delete;
  virtual ~Gpio() = default;

  /// Sets the outputs among `lines`, with one call per chip. false: see errno.
  /// Async-signal-safe, because a crashing process uses it to make its lines safe.
  virtual bool put(std::uint32_t levels, std::uint32_t lines) noexcept = 0;
  bool put(std::uint32_t levels) noexcept { return put(levels, UINT32_MAX); }
  /// Present levels of the inputs; output bits are 0. false: see errno.
  virtual bool inputs(std::uint32_t& levels) const noexcept = 0;
  /// Descriptors that are readable while edges wait.
  virtual std::span<const int> edge_fds() const = 0;
  /// Takes input edges in order of time, at most out.size(), without waiting. The kernel stamps them with
  /// CLOCK_MONOTONIC when it handles the interrupt. lost: set if the kernel's buffer overflowed.
  virtual std::size_t read_edges(std::span<hal::CapturedEdge> out, bool& lost) = 0;
};

/// One of the kernel's LEDs (/sys/class/leds/.../brightness), or none.
class Led final : public hal::Indicator {
 public:
  explicit Led(const std::string& brightness)
      : file_(brightness.empty() ? -1 : ::open(brightness.c_str(), O_WRONLY | O_CLOEXEC)) {}

  bool ok() const { return static_cast<bool>(file_); }
  void show(bool on) override {
    if (!file_ || on == on_) return;
    on_ = on;
    [[maybe_unused]] const ssize_t written = ::pwrite(file_.get(), on ? "1" : "0", 1, 0);
  }

 private:
  Fd file_;
  bool on_ = false;
};

}  // namespace symrig::board_linux
