// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/v4l2/sequence.hpp"

#include <cstdint>
#include <optional>
#include <set>

namespace symrig::camera {

/// Extends a camera's frame ids, or its trigger counter, to numbers that do not wrap. GVSP 1.x has ids of 16
/// bits, which skip 0: 65535 is followed by 1 [GigE Vision 1.2, §24]. Later ids have 64 bits. An id of 0 or
/// above 65535 shows which kind it is.
class FrameNumbers {
 public:
  struct Reading {
    std::uint64_t number = 0;
    Step step = Step::first;
    std::uint64_t missing = 0;  ///< Step::gap: the numbers left out
    bool found = false;         ///< its number was left out before: the frame is out of order
  };

  /// counter: the trigger counter of the frame's chunk data; it counts triggers whose frame was lost.
  Reading read(std::uint64_t id, std::optional<std::uint32_t> counter);
  /// The camera restarts its count. At least one number is skipped, so that frames of two streams are never
  /// adjacent.
  void restart();

 private:
  struct Anchor {
    std::uint64_t at = 0;      // the camera's number
    std::uint64_t number = 0;  // ours
  };

  std::int64_t ids_since(std::uint64_t id) const;
  void leave_out(std::uint64_t begin, std::uint64_t end);

  std::optional<Anchor> id_, counter_;
  std::uint64_t base_ = 0, last_ = 0, highest_ = 0;
  bool wide_ = false, begun_ = false;
  std::set<std::uint64_t> left_out_;  // the newest numbers without a frame
};

}  // namespace symrig::camera
