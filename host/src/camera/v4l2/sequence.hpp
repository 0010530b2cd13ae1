// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace symrig::camera {

/// How a frame's number follows the one before.
enum class Step : std::uint8_t { first, next, gap, repeated, backwards };

/// A driver's 32-bit count of frames as one that does not wrap and goes on over restarts of the stream.
class SequenceCount {
 public:
  struct Reading {
    std::uint64_t number = 0;
    Step step = Step::first;
    std::uint64_t missing = 0;  ///< numbers left out before it
  };

  /// Numbers at most 2^31 apart from the one before are on its near side; others have wrapped.
  Reading read(std::uint32_t driver);
  /// The driver begins to count anew. At least one number is left out, so that frames of two streams never
  /// look as if nothing were between them.
  void restart();

 private:
  Reading begin(std::uint32_t driver);

  std::uint64_t base_ = 0;  // number of the driver's frame 0 of this stream
  std::uint64_t last_ = 0;
  std::uint32_t last_driver_ = 0;
  bool begun_ = false;
};

}  // namespace symrig::camera
