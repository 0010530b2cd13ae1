// SPDX-License-Identifier: Apache-2.0
// What the sums of the pairs and the edges of their stripes tell about a sequence.
#pragma once

#include "calibration/sequence/sequence_light.hpp"
#include "symrig/base/result.hpp"

#include <optional>
#include <string>
#include <vector>

namespace symrig::calibration {

/// What a value is the largest code of, if it is one: "code 4095 of 65535, the largest of 12 bits". Cameras
/// of 8 to 15 bits write their codes into the low or into the high bits of a larger word.
std::optional<std::string> largest_code_at(float value);

/// White is saturated if more than 2 % of the lit pixels stand at the largest value, and it is
/// - CodePhotographs::saturation; or
/// - the largest code of fewer bits; or
/// - any value, although the sums of their pairs differ from pixel to pixel; or
/// - any value without noise: the pixels stand there in all patterns that light them, while darker pixels
///   change from pattern to pattern.
/// error: a scene of one value, without noise, is not refused.  fails: bad_value.
Result<void> check_saturation(const SequenceLight& light);

struct SumsVerdict {
  Result<void> result;
  bool change = false;    ///< the cause may be a change at some photograph, which includes a movement
  bool definite = false;  ///< only these photographs are wrong, and in this way
};

/// A pattern and its complement add up to white + black, so all sums are one picture. This finds the sums
/// that differ, and their cause: a photograph of another pair; two exchanged photographs; a lamp, a camera or
/// a scene that changed from some photograph on; a wrong white or black.
/// fails: bad_value; the message names the photographs at fault, or all possible ones.
SumsVerdict check_sums(const SequenceLight& light);

/// The result for the order of the pairs.
struct OrderFinding {
  bool right = true;
  std::vector<std::string> explanations;  ///< the best ones, if the order is not right
  std::string advice;
};

/// Finds the order of the photographs from the stripes. Where Gray bit k changes, bit k + 1 of the same axis
/// is lit and all finer bits are dark. So it reads the signs of all other pairs at the edges of each pair.
/// Each explanation predicts those signs: the order is right; a pair is inverted, exchanged with another, a
/// copy of another, or of another picture; the axes divide the pairs in another way; the least significant
/// bit comes first. The likelihood of an explanation assumes that every tenth sign is wrong (depth edges,
/// noise). It counts at most 25 edges of a pair, because neighbouring edges are not independent. The order is
/// wrong if another explanation is e¹⁰ times as likely.
OrderFinding judge_order(const SequenceLight& light);

/// The positions outside the projector.
struct CodeReach {
  struct OfAxis {
    int farthest = 0;      ///< 0: none is outside
    bool swapped = false;  ///< if the coarsest pair is swapped, none is outside
    int first = 0;         ///< > 0: the code begins here, in the middle of its range: a centred pattern
    int last = 0;          ///< then: the last position
  };
  OfAxis columns, rows;
  bool exchanged = false;  ///< with rows for columns, none is outside
  bool mirrored = false;   ///< neighbours lie as in a mirror; known if some position is outside
};
CodeReach find_reach_beyond(const SequenceLight& light);

}  // namespace symrig::calibration
