// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig::camera {

/// How a frame's number compares to the previous one.
enum class Step : std::uint8_t { first, next, gap, repeated, backwards };

/// Extends a driver's 32-bit frame count: it does not wrap, and it continues when the stream restarts.
class SequenceCount {
 public:
  struct Reading {
    std::uint64_t number = 0;
    Step step = Step::first;
    std::uint64_t missing = 0;  ///< numbers skipped before this frame
  };

  /// A number up to 2^31 away from the previous one is compared directly. A greater distance means that the
  /// count wrapped.
  Reading read(std::uint32_t driver);
  /// The driver restarts its count. Skips at least one number, so that frames of two streams are never
  /// adjacent.
  void restart();

 private:
  Reading begin(std::uint32_t driver);

  std::uint64_t base_ = 0;  // extended number of the driver's frame 0 in this stream
  std::uint64_t last_ = 0;
  std::uint32_t last_driver_ = 0;
  bool begun_ = false;
};

}  // namespace symrig::camera
