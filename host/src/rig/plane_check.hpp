// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/bracket_taker.hpp"
#include "symrig/base/result.hpp"
#include "symrig/rig/rig.hpp"

namespace symrig {

/// Checks with light what no edge tells: that plane k of a picture is bright between its edges, `latency`
/// refreshes after the scan-out of the picture.
///
/// For each plane, a picture lights this plane alone, and one exposure between its edges must see three
/// quarters of the light of a picture that lights all planes. A plane that comes in another place, twice, in
/// another refresh or not at all leaves its exposure dark. That is one refresh for each plane, if the camera
/// is as fast. If it fails, more exposures find out what the projector showed, for the message.
///
/// longest: an exposure that does not saturate the flood-lit scene. If no exposure of the camera fits into a
/// plane, or a plane has too little light, only the latency is checked, and the taker warns.
/// fails: device_refused (names what was seen, and the key to set), as BracketTaker::take().
Result<void> check_planes(BracketTaker& taker, const RigOptions& options, Nanoseconds longest);

}  // namespace symrig
