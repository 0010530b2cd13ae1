// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/projector/projector.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace symrig {

/// An exposure that is to be taken.
struct WantedExposure {
  std::size_t photograph = 0;  ///< also the index of its pattern
  std::size_t exposure = 0;    ///< within the photograph's bracket
  Nanoseconds time{0};
};

/// An exposure with its place in the planes of a picture.
struct PlannedExposure {
  WantedExposure what;
  PlaneExposure at;
};

/// A picture, and the exposures that are taken while it stays on the screen, in order of time.
struct PlanePicture {
  PlanePlan plan;
  std::vector<PlannedExposure> exposures;
};

/// The times that a schedule must keep.
struct PlaneRules {
  PlaneTiming timing;
  Nanoseconds refresh{0};
  Nanoseconds settle{0};  ///< from a plane's edge to the exposure
  Nanoseconds gap{0};     ///< from the end of an exposure to the next trigger
};

/// The longest exposure in the planes of one picture. Several planes of one pattern are one light only if
/// there is no dark time between them. fails: limit (a plane is shorter than its settling).
Result<Nanoseconds> longest_in_planes(const PlaneRules& rules);

/// The exposure that the planes give for a wanted one. Up to longest_in_planes() it is the wanted one. A
/// longer one is taken over whole refreshes of a picture whose planes all show the pattern. Its light is that
/// of all planes of these refreshes, and it is never longer than wanted. fails: limit (longer than
/// longest_in_planes(), and there is dark time between planes).
Result<Nanoseconds> light_in_planes(Nanoseconds wanted, const PlaneRules& rules);

/// true: an exposure over whole refreshes.
bool over_refreshes(const PlaneExposure& at, const PlaneRules& rules);

/// The light of an exposure whose shutter was open for `width`.
Nanoseconds light_of(const PlaneExposure& at, Nanoseconds width, const PlaneRules& rules);

/// Puts exposures into the planes of as few pictures as possible, in order of the photographs.
///
/// A pattern gets as many neighbouring planes as its longest exposure needs. Planes that are left are black.
/// A picture stays on the screen until all its exposures are taken: of those that are left, the one whose
/// plane comes next is taken next. So a camera that is slower than the planes takes them over several
/// refreshes. fails: limit (as light_in_planes()).
Result<std::vector<PlanePicture>> plan_planes(std::span<const WantedExposure> wanted,
                                              const PlaneRules& rules);

}  // namespace symrig
