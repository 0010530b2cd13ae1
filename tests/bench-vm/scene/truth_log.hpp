// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/delivery.hpp"
#include "bench-vm/scene/stage.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <fstream>
#include <span>
#include <string>
#include <vector>

namespace symrig::bench_vm {

/// An exposure as TruthLog records it.
struct TrueExposure {
  std::uint64_t frame = 0;  ///< number of exposures before it
  Nanoseconds open{};
  std::uint64_t picture = 0;  ///< key of the picture that was lit
  bool pure = false;          ///< no other picture was lit, and this one nearly all the time
  double share = 1;           ///< of the time in which it was lit; the screen was dark for the rest

  Nanoseconds lit() const;  ///< the time in which it was lit
};

/// Equal pictures have equal keys.
std::uint64_t picture_key(const Image<float>& picture);

/// The exposures of a log, in order.
/// fails: not_found, bad_format (the message names the line).
Result<std::vector<TrueExposure>> read_true_exposures(const std::string& path);

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
