// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/context.hpp"
#include "acquisition/search/node.hpp"

#include <cstdint>
#include <set>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Stores a diagonal node as direct light alone: T_ii = c_i.
void add_direct(Context& context, const NodeLevel& level, const Node& node);

/// If the light that is still unknown goes no farther than a few pixels (0: direct light; more: defocus, the
/// spread of optics), settles all of it and empties `open`: radius p is the least that no unknown pair of
/// blocks has light beyond; p = 0 needs no photograph, p ≥ 1 needs the (2p + 1)² combs of every (2p + 1)-th
/// pixel in both directions, in which no camera pixel sees two lit ones. Kept only if the check photographs
/// are dark where they should be; not tried if the combs cost more than `budget` or than the levels that are
/// left. Result: settled. refused: radii that the check photographs have refused before; they are not tried
/// again.
Result<bool> settle_short_range(Context& context, Checks& checks, std::vector<NodeLevel>& open,
                                std::int64_t budget, std::set<int>& refused);

}  // namespace symrig::acquisition
