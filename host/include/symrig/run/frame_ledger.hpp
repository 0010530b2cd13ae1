// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/receipt.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A frame as the camera side tells of it.
struct FrameStamp {
  std::uint64_t sequence = 0;  ///< the camera's own count
  Ticks begin;                 ///< start of exposure on the board's clock (strobe edge)
};

/// What became of one exposure that the program asked for.
struct LedgerEntry {
  std::uint32_t photograph = 0;      ///< patterns asked for before it, minus one
  std::uint32_t exposure = 0;        ///< within the bracket
  Ticks asked;                       ///< tick of its mark
  std::optional<std::size_t> frame;  ///< index into the frames given; none = missing
  Ticks delay;                       ///< from mark to exposure, if there is a frame
};

/// Which frame belongs to which step: pairs the marks of a bracket program with frames by time, so that a
/// frame that was lost or came unasked is named instead of shifting all that follow.
class FrameLedger {
 public:
  /// A frame belongs to the mark at or before its begin if it is at most `tolerance` later.
  /// marks and frames in order of time. fails: bad_argument (out of order).
  static Result<FrameLedger> pair(std::span<const StepMark> marks, std::span<const FrameStamp> frames,
                                  Ticks tolerance);

  std::span<const LedgerEntry> entries() const { return entries_; }
  /// Frames nobody asked for, as indices into the frames given.
  std::span<const std::size_t> unasked() const { return unasked_; }
  std::size_t missing() const;
  bool complete() const { return missing() == 0 && unasked_.empty(); }
  /// "3200 frames for 3200 exposures", or what is wrong and where it begins.
  std::string summary() const;

 private:
  std::vector<LedgerEntry> entries_;
  std::vector<std::size_t> unasked_;
};

/// Rising edges of a captured line (the camera's strobe) as frames, numbered from 0.
std::vector<FrameStamp> frames_from_strobe(const Receipt& receipt, int strobe_line);

}  // namespace symrig
