// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/bracket_taker.hpp"
#include "symrig/base/result.hpp"
#include "symrig/rig/rig.hpp"

#include <span>
#include <vector>

namespace symrig {

/// The light of a photograph: the sum over its valid pixels, and the sigma of this sum.
struct TotalLight {
  double sum = 0;
  double sigma = 0;
};

/// The light of a bracket that was taken.
Result<TotalLight> total_light(const TakenBracket& taken, const BracketTaker& taker,
                               const RigOptions& options);

/// The light of shots with one exposure each. One of them must light its plane.
/// fails: as BracketTaker::take().
Result<std::vector<TotalLight>> take_shots(BracketTaker& taker, const RigOptions& options,
                                           std::span<const PlaneShot> shots, Nanoseconds exposure);

/// A plane of which the light of a slot is not the same in each refresh.
inline constexpr int kChangingPlane = -2;

/// Which plane of its picture the projector shows in the time of plane 0, 1, …: its number, kBlackPlane if
/// none, or kChangingPlane.
///
/// Plane j has the code j + 1. For each bit of the codes, one picture lights the planes whose code has this
/// bit, and one lights the others. So each slot shows the code of its plane. fails: as BracketTaker::take().
Result<std::vector<int>> planes_seen(BracketTaker& taker, const RigOptions& options, Nanoseconds exposure);

}  // namespace symrig
