// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/alignment.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace symrig {

/// One measurement of `symrig align`.
struct AlignmentUpdate {
  std::string rig;         ///< as it describes itself
  std::int64_t count = 1;  ///< of updates so far
  double seconds = 0;      ///< since the start
  Alignment alignment;
  std::vector<AlignmentFinding> findings;
  int cell = 0;  ///< projector pixels along the side of a cell; 0: not known
};

/// One line of `symrig align --json`.
std::string alignment_json(const AlignmentUpdate& update);

/// One line for a log.
std::string alignment_line(const AlignmentUpdate& update);

/// The names of the goals that are not met, "cells seen, blur"; empty: all are.
std::string missed_goals(const std::vector<AlignmentFinding>& findings);

/// What to do for a goal that is not met, in words.
std::string advice(const AlignmentFinding& finding, const Alignment& alignment);

/// The page for the person at the screws. before: the update before this one, or nullptr.
std::string alignment_page(const AlignmentUpdate& update, const AlignmentUpdate* before);

/// A picture of what is left over of the map: a point, an arrow or a double arrow for each part of the
/// camera's picture, by length. columns: of the terminal.
std::string left_over_picture(const Alignment& alignment, std::size_t columns);

}  // namespace symrig
