// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/response.hpp"

#include <vector>

namespace symrig::hdr {

/// fails: size_mismatch, bad_argument (fewer than two different exposures, no pixels).
Result<void> check_frames(std::span<const Frame> frames);

/// Codes that are used: low < code < high.
struct UsableCodes {
  int codes;  ///< of the camera
  int low, high;

  bool usable(int code) const { return code > low && code < high; }
  /// 1 in the middle, falling to 0 at both ends: noise below, clipping above.
  double weight(int code) const;
};
UsableCodes usable_codes(const ResponseOptions& options);

/// Numbers of pixels to recover a curve from: spread over the codes that the middle exposure gives, so that
/// no code dominates; at most `most`. Each is usable in two frames at least.
std::vector<std::size_t> choose_pixels(std::span<const Frame> frames, const UsableCodes& codes,
                                       std::size_t most);

ResponseCurve finish_curve(const std::vector<double>& log_light, const std::vector<double>& weights,
                           std::int64_t samples);

}  // namespace symrig::hdr
