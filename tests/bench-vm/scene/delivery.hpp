// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/frame_faults.hpp"

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

namespace symrig::bench_vm {

using Codes = std::shared_ptr<const std::vector<std::uint16_t>>;

/// A frame as the sensor made it.
struct FinishedFrame {
  std::uint64_t frame = 0;  ///< exposures before it
  Nanoseconds stamp{};
  Nanoseconds ready{};  ///< read out: not delivered before
  Codes codes;
};

/// A frame as the driver hands it over.
struct DeliveredFrame {
  std::uint64_t frame = 0;  ///< which exposure it truly is
  FrameFault fault = FrameFault::none;
  Nanoseconds due{};
  Nanoseconds stamp{};
  std::uint32_t skip = 0;  ///< sequence numbers that it leaves out
  bool damaged = false;
  Codes codes;
};

/// The way from the sensor to the driver, with what goes wrong on it. One frame at a time: what waits for a
/// late frame is late, too.
class Delivery {
 public:
  explicit Delivery(FaultRates rates) : rates_(rates) {}

  /// In order of exposure.
  void add(FinishedFrame finished);
  /// When the next frame will be due; nothing: none is on its way.
  std::optional<Nanoseconds> next_due() const;
  /// The frames that are due by now, in the order of their delivery.
  std::vector<DeliveredFrame> take_due(Nanoseconds now);
  std::uint64_t dropped() const { return dropped_; }

 private:
  void enqueue(DeliveredFrame frame);

  FaultRates rates_;
  std::deque<DeliveredFrame> queue_;
  std::optional<DeliveredFrame> held_;  // to be overtaken by the next frame
  Nanoseconds busy_until_{};
  std::uint32_t skip_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace symrig::bench_vm
