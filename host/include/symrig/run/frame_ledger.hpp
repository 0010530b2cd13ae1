// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/program.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A frame, from the camera or from its strobe line.
struct FrameStamp {
  std::uint64_t sequence = 0;  ///< the camera's frame number
  Ticks begin;                 ///< start of exposure on the board's clock (strobe edge)
};

/// The result of one exposure of the program.
struct LedgerEntry {
  std::uint32_t photograph = 0;      ///< counted from 0: pattern marks before it, minus one
  std::uint32_t exposure = 0;        ///< its index in the bracket
  Ticks asked;                       ///< tick of its mark
  std::optional<std::size_t> frame;  ///< index into the given frames; none = missing
  Ticks delay;                       ///< from mark to exposure, if there is a frame
};

/// Pairs the marks of a bracket program with frames by time. So a lost or unexpected frame is reported, and
/// does not shift all later frames.
class FrameLedger {
 public:
  /// A frame belongs to the last mark at or before its begin, if it begins at most `tolerance` after the
  /// mark. marks and frames: sorted by time. fails: bad_argument (out of order).
  static Result<FrameLedger> pair(std::span<const StepMark> marks, std::span<const FrameStamp> frames,
                                  Ticks tolerance);

  std::span<const LedgerEntry> entries() const { return entries_; }
  /// Unexpected frames, as indices into the given frames.
  std::span<const std::size_t> unasked() const { return unasked_; }
  std::size_t missing() const;
  bool complete() const { return missing() == 0 && unasked_.empty(); }
  /// "3200 frames for 3200 exposures", with the number and first place of missing and unexpected frames.
  std::string summary() const;

 private:
  std::vector<LedgerEntry> entries_;
  std::vector<std::size_t> unasked_;
};

/// Rising edges of a captured line (the camera's strobe) as frames, numbered from 0.
std::vector<FrameStamp> frames_from_strobe(const Receipt& receipt, int strobe_line);

}  // namespace symrig
