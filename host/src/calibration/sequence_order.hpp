// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/sequence_light.hpp"

#include <string>
#include <vector>

namespace symrig::calibration {

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
  };
  Axis columns, rows;
};
Reach find_reach_beyond(const SequenceLight& light);

}  // namespace symrig::calibration
