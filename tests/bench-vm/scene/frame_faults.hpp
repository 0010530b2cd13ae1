// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

#include <cstdint>
#include <string_view>

namespace symrig::bench_vm {

/// What can happen to a frame between the sensor and the host.
enum class FrameFault : std::uint8_t {
  none,
  drop,       ///< never delivered
  duplicate,  ///< delivered twice
  late,       ///< delivered, and stamped, late
  swap,       ///< delivered after the frame that follows it
  damage      ///< delivered with half of it missing, and marked so
};
std::string_view name(FrameFault fault);

/// How often each happens: shares of frames, their sum at most 1.
struct FaultRates {
  double drop = 0;
  double duplicate = 0;
  double late = 0;
  double swap = 0;
  double damage = 0;
  Nanoseconds late_by{33'333'333};  ///< a period of a 30 Hz camera
  Nanoseconds jitter{0};            ///< one sigma of the stamps
  bool counted = true;              ///< the sequence number counts dropped frames
  std::uint64_t seed = 1;

  bool valid() const;
};

/// A function of (seed, frame) alone.
FrameFault fault_of(const FaultRates& rates, std::uint64_t frame);
/// Normally distributed, one sigma of rates.jitter; a function of (seed, frame) alone.
Nanoseconds jitter_of(const FaultRates& rates, std::uint64_t frame);

}  // namespace symrig::bench_vm
