// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "camera/genicam/features.hpp"
#include "symrig/board/clock_model.hpp"

#include <optional>
#include <string>

namespace symrig::camera {

/// The camera's clock against CLOCK_MONOTONIC. The camera latches its clock between two readings of ours, so
/// the offset is known to half the time between them.
class ClockMap {
 public:
  /// Latches the camera's clock. false: the camera has no such command, or did not answer within 200 µs. Then
  /// the last offset stays.
  bool latch(Features& features);
  /// at: the camera's stamp in nanoseconds. None: no latch has succeeded yet.
  std::optional<SteadyTime> host(std::uint64_t at) const;

 private:
  std::optional<Nanoseconds> offset_;  // ours minus the camera's
};

/// CLOCK_MONOTONIC.
Nanoseconds monotonic_now();

}  // namespace symrig::camera
