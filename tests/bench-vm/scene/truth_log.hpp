// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/delivery.hpp"
#include "bench-vm/scene/stage.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <fstream>
#include <span>
#include <string>

namespace symrig::bench_vm {

/// Records the true exposures and deliveries, one JSON object per line. Times are nanoseconds of
/// CLOCK_MONOTONIC:
///
///   {"exposed":7,"begin":…,"end":…,"doubt":…,"lit":[{"picture":3,"key":"91c2…","share":1}]}
///   {"delivered":7,"fault":"none","stamp":…,"skip":0,"damaged":false,"taken":"yes"}
///
/// Equal pictures have equal keys. A picture without light has "dark":true, too.
class TruthLog {
 public:
  /// With an empty path it writes nothing.
  /// fails: io.
  static Result<TruthLog> open(const std::string& path);

  void exposed(const Exposure& exposure, std::span<const ScreenTimeline::Lit> lit);
  void delivered(const DeliveredFrame& frame, CameraPort::Taken taken);
  /// Writes the last line with the caller's totals.
  /// fails: io (full disk).
  Result<void> close(const std::string& totals);

 private:
  void line(const std::string& text);

  std::ofstream file_;
};

}  // namespace symrig::bench_vm
