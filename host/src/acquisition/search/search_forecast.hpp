// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// A level of the search while its photographs are taken.
struct LevelPlan {
  int level = 0;
  std::int64_t planned = 0;          ///< photographs of this level
  std::int64_t before = 0;           ///< photographs of the level before
  std::int64_t taken = 0;            ///< photographs when this level is done
  double direct_share = 0;           ///< of all photographs: flood-lit ones at the end
  std::span<const double> children;  ///< of a block of each level that can be searched: 4, fewer near pixels
};

/// LevelPlan::children of a tree.
std::vector<double> children_per_block(const BlockTree& tree);

/// Photographs after this level. The tests of the level above decide how many a level needs, but successive
/// levels are alike. Captures of all simulated scenes from 24x40 to 128x128, tolerances from 1e-5 to 3e-3:
/// a level took 0.7 to 2.2 times the photographs of the level before, and all later levels 0.9 to 1.7 times
/// in the mean. The result is unknown where blocks share no photographs, because then nothing bounds the next
/// level. It is unknown in level 0 too, after which scenes of direct light end.
UnitsToCome forecast_later(const LevelPlan& plan);

/// Photographs of this level and all later ones, if level 2 takes `second` times as many as level 1 and each
/// later one `growth` times as many as the one before, as far as its blocks have children to light.
double photographs_if_growing(const LevelPlan& plan, double second, double growth);

/// Photographs of this level and all later ones, if each level grows as much as the forecast allows.
double most_photographs(const LevelPlan& plan);

}  // namespace symrig::acquisition
