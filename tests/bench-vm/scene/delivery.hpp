// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

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

using Codes = std::shared_ptr<const std::vector<std::uint16_t>>;

/// A frame from the sensor.
struct FinishedFrame {
  std::uint64_t frame = 0;  ///< number of exposures before it
  Nanoseconds stamp{};
  Nanoseconds ready{};  ///< end of the readout; not delivered earlier
  Codes codes;
  Nanoseconds open{};  ///< the exposure's length
};

/// A frame as the driver delivers it.
struct DeliveredFrame {
  std::uint64_t frame = 0;  ///< its true exposure
  FrameFault fault = FrameFault::none;
  Nanoseconds due{};
  Nanoseconds stamp{};
  std::uint32_t skip = 0;  ///< sequence numbers that are skipped before it
  bool damaged = false;
  Codes codes;
  Nanoseconds open{};
};

/// The path from the sensor to the driver, with its faults. It carries one frame at a time, so frames behind
/// a late frame are late, too.
class Delivery {
 public:
  /// by_camera: the camera delays and swaps frames itself. They are marked, and delivered as exposed.
  explicit Delivery(FaultRates rates, bool by_camera = false) : rates_(rates), by_camera_(by_camera) {}

  /// Call it in the order of exposure.
  void add(FinishedFrame finished);
  /// When the next frame is due. None: no frame is on its way.
  std::optional<Nanoseconds> next_due() const;
  /// The frames that are due by now, in the order of their delivery.
  std::vector<DeliveredFrame> take_due(Nanoseconds now);
  std::uint64_t dropped() const { return dropped_; }

 private:
  void enqueue(DeliveredFrame frame);

  FaultRates rates_;
  bool by_camera_;
  std::deque<DeliveredFrame> queue_;
  std::optional<DeliveredFrame> held_;  // waits for the next frame to overtake it
  Nanoseconds busy_until_{};
  std::uint32_t skip_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace symrig::bench_vm
