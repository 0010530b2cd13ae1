// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"

#include <cstdint>
#include <optional>
#include <string_view>

namespace symrig::bench_vm {

/// Faults of a frame between the sensor and the host.
enum class FrameFault : std::uint8_t {
  none,
  drop,       ///< never delivered
  duplicate,  ///< delivered twice
  late,       ///< delivered, and stamped, late
  swap,       ///< delivered after the frame that follows it
  damage      ///< delivered with half of its data, and marked as damaged
};
std::string_view name(FrameFault fault);

/// The share of frames with each fault. Their sum is at most 1.
struct FaultRates {
  double drop = 0;
  double duplicate = 0;
  double late = 0;
  double swap = 0;
  double damage = 0;
  double drop_trigger = 0;                    ///< of triggers, not of frames: the camera does not see them
  Nanoseconds late_by{33'333'333};            ///< a period of a 30 Hz camera
  Nanoseconds jitter{0};                      ///< one sigma of the stamps
  bool counted = true;                        ///< the sequence number counts dropped frames
  std::optional<std::uint64_t> drop_frame{};  ///< this frame is dropped, whatever the shares
  std::uint64_t seed = 1;

  bool valid() const;
};

/// Depends only on (seed, frame).
FrameFault fault_of(const FaultRates& rates, std::uint64_t frame);
/// false: the camera does not see the trigger of this number. Depends only on (seed, number).
bool sees_trigger(const FaultRates& rates, std::uint64_t number);
/// Normally distributed, one sigma of rates.jitter. Depends only on (seed, frame).
Nanoseconds jitter_of(const FaultRates& rates, std::uint64_t frame);

}  // namespace symrig::bench_vm
