// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/sequence_light.hpp"

#include <string>
#include <vector>

namespace symrig::calibration {

/// What is said of the order in which the pairs stand.
struct OrderFinding {
  bool right = true;
  std::vector<std::string> explanations;  ///< those that fit best, if it is not right
  std::string advice;
};

/// Which order the stripes themselves tell. Where Gray bit k changes, bit k + 1 of the same axis is lit and
/// all finer ones are dark: at the edges of each pair the others are looked at. Each explanation (the order
/// is right; a pair is inverted, exchanged with another, a copy of another, or of something else; the axes
/// divide the pairs otherwise; the least significant come first) foretells those signs. Its likelihood is
/// taken, with every tenth sign wrong (depth edges, noise) and no more than 25 edges of a pair counted, as
/// neighbours tell the same. The order is wrong if another one is e¹⁰ times as likely.
OrderFinding judge_order(const SequenceLight& light);

/// How far positions reach beyond the projector.
struct Reach {
  struct Axis {
    int farthest = 0;      ///< 0: none reaches beyond
    bool swapped = false;  ///< with the coarsest pair swapped they would not
  };
  Axis columns, rows;
};
Reach find_reach_beyond(const SequenceLight& light);

}  // namespace symrig::calibration
