// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/response.hpp"

#include <vector>

namespace symrig::hdr {

/// fails: size_mismatch, bad_argument (fewer than two different exposures, no pixels).
Result<void> check_frames(std::span<const Frame> frames);

/// The usable codes: low < code < high.
struct UsableCodes {
  int codes;  ///< of the camera
  int low, high;

  bool usable(int code) const { return code > low && code < high; }
  /// 1 in the middle, falling to 0 at both ends, because of noise below and clipping above.
  double weight(int code) const;
};
UsableCodes usable_codes(const ResponseOptions& options);

/// Indices of at most `most` pixels from which to recover a curve. They are spread over the codes of the
/// middle exposure, so that no code dominates. Each is usable in at least two frames.
std::vector<std::size_t> choose_pixels(std::span<const Frame> frames, const UsableCodes& codes,
                                       std::size_t most);

ResponseCurve finish_curve(const std::vector<double>& log_light, const std::vector<double>& weights,
                           std::int64_t samples);

}  // namespace symrig::hdr
