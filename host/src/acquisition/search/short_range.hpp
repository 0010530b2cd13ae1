// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/findings.hpp"
#include "acquisition/tree/photographer.hpp"

#include <cstdint>
#include <set>
#include <span>
#include <vector>

namespace symrig::acquisition {

/// Settles all unknown light if it goes no farther than a few pixels. Radius 0 is direct light. A larger one
/// is defocus, or the spread of optics.
class ShortRange {
 public:
  ShortRange(const SearchFacts& facts, Photographer& photographer, Findings& found)
      : facts_(facts), photographer_(photographer), found_(found) {}

  /// True if it has settled all unknown light; then no node is open. The radius p is the least that no
  /// unknown pair of blocks has light beyond. p = 0 needs no photograph. p ≥ 1 needs (2p + 1)² combs: every
  /// (2p + 1)-th pixel in both directions, so that no camera pixel sees two lit ones.
  /// The result is kept only if the check photographs are dark where they should be; a radius that they
  /// refuse is not tried again. Combs that cost more than `budget` or than the levels left are not taken.
  /// fails: as Photographer::take.
  Result<bool> settle(Checks& checks, std::int64_t budget);

 private:
  Result<void> add_band(int radius);
  bool cheaper_than_levels(std::int64_t combs) const;

  const SearchFacts& facts_;
  Photographer& photographer_;
  Findings& found_;
  std::set<int> refused_;  ///< radii
};

}  // namespace symrig::acquisition
