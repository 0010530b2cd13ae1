// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/alignment.hpp"

#include <algorithm>
#include <cmath>

namespace symrig {
namespace {

AlignmentFinding at_least(AlignmentGoal goal, double value, double wanted) {
  return {goal, value, wanted, value >= wanted, 0};
}

AlignmentFinding at_most(AlignmentGoal goal, double value, double wanted) {
  return {goal, value, wanted, value <= wanted, 0};
}

/// A length in cells: larger cells make it smaller.
AlignmentFinding cells_at_most(AlignmentGoal goal, double value, double wanted) {
  return {goal, value, wanted, value <= wanted, value / wanted};
}

}  // namespace

std::vector<AlignmentFinding> judge(const Alignment& a, const AlignmentGoals& goals) {
  std::vector<AlignmentFinding> findings{at_least(AlignmentGoal::stripes, a.seen ? 1 : 0, 1)};
  if (!a.seen) return findings;
  findings.push_back(at_least(AlignmentGoal::cells, a.cells_seen, goals.cells_seen));
  if (a.own_pixels()) {
    findings.push_back(at_least(AlignmentGoal::pixels, a.shape.pixels_per_cell, goals.least_pixels));
    findings.back().cell_factor = goals.least_pixels / a.shape.pixels_per_cell;
  } else {
    findings.push_back(at_most(AlignmentGoal::offset, a.offset, goals.offset));
  }
  if (a.own_pixels()) findings.push_back(cells_at_most(AlignmentGoal::focus, a.blur(), goals.blur));
  findings.push_back(cells_at_most(AlignmentGoal::parallax, a.shape.parallax.range, goals.parallax));
  findings.push_back(at_most(AlignmentGoal::saturated, a.saturated, goals.saturated));
  findings.push_back(at_least(AlignmentGoal::light, a.signal_to_noise, goals.signal_to_noise));
  return findings;
}

bool all_good(const std::vector<AlignmentFinding>& findings) {
  return std::ranges::all_of(findings, &AlignmentFinding::good);
}

double cell_factor(const std::vector<AlignmentFinding>& findings) {
  double factor = 0;
  for (const AlignmentFinding& finding : findings) factor = std::max(factor, finding.cell_factor);
  return factor;
}

}  // namespace symrig
