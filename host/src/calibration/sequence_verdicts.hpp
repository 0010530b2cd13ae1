// SPDX-License-Identifier: Apache-2.0
// What the sums of the pairs and the edges of their stripes tell about a sequence.
#pragma once

#include "calibration/sequence_light.hpp"
#include "symrig/base/result.hpp"

#include <string>
#include <vector>

namespace symrig::calibration {

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
struct Reach {
  struct Axis {
    int farthest = 0;      ///< 0: none is outside
    bool swapped = false;  ///< if the coarsest pair is swapped, none is outside
    int first = 0;         ///< > 0: the code begins here, in the middle of its range: a centred pattern
    int last = 0;          ///< then: the last position
  };
  Axis columns, rows;
  bool exchanged = false;  ///< with rows for columns, none is outside
  bool mirrored = false;   ///< neighbours lie as in a mirror; known if some position is outside
};
Reach find_reach_beyond(const SequenceLight& light);

}  // namespace symrig::calibration
