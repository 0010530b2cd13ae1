// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/capture.hpp"

#include <cstddef>
#include <cstdint>
#include <span>

namespace symrig::board_linux {

/// The board's lines, numbered as on the wire: bit k of a word is line k.
class Gpio {
 public:
  Gpio() = default;
  Gpio(const Gpio&) = delete;
  Gpio& operator=(const Gpio&) = delete;
  virtual ~Gpio() = default;

  /// Sets the outputs among `lines`, those of one chip by one call. false: errno tells why.
  /// Async-signal-safe, because a process that breaks down makes its lines safe with it.
  virtual bool put(std::uint32_t levels, std::uint32_t lines) noexcept = 0;
  bool put(std::uint32_t levels) noexcept { return put(levels, UINT32_MAX); }
  /// Levels of the inputs now; output bits are 0. false: errno tells why.
  virtual bool inputs(std::uint32_t& levels) const noexcept = 0;
  /// Readable while edges wait.
  virtual std::span<const int> edge_fds() const = 0;
  /// Takes edges of inputs in order of time, without waiting: at most out.size(). Their ticks are
  /// CLOCK_MONOTONIC, by the kernel where it answered the interrupt. lost is set if the kernel had more than
  /// it could keep.
  virtual std::size_t read_edges(std::span<hal::CapturedEdge> out, bool& lost) = 0;
};

}  // namespace symrig::board_linux
