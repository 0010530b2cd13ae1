// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/evidence.hpp"
#include "rig/plane_schedule.hpp"

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace symrig {

/// The lines of the trigger outputs, as numbers on the board.
struct PlaneLines {
  int frame = -1;  ///< an edge before plane 0 of each refresh
  int plane = -1;  ///< an edge at each plane
  bool frame_low = false, plane_low = false;
};

/// Why an exposure does not prove its plane. `proved`: plane `at.plane` of the picture was lit from its edge
/// on, and the exposure ended within the planes with its pattern.
enum class PlaneProof : std::uint8_t {
  proved,
  no_exposure,      ///< the line shows no exposure
  no_refresh,       ///< no frame edge before it
  earlier_picture,  ///< its refresh began before the planes of this picture
  edges_missing,    ///< the edges since the frame edge are not one a plane
  other_plane       ///< it began in another plane, or ended after its planes
};

/// For messages: "no edge of the vsync line before an exposure".
std::string_view text_of(PlaneProof proof);

/// Proves from the edges that the board captured in which planes the exposures of a run were taken.
///
/// Between the frame edge before an exposure and its begin there must be exactly plane + 1 plane edges, the
/// first one frame_lead after the frame edge, the others a period apart. The picture's planes begin `latency`
/// refreshes after the scan-out of the picture began (`since`), so an earlier frame edge proves nothing.
/// fails: as SteadyClock::at().
Result<std::vector<PlaneProof>> prove_planes(const Receipt& receipt, const PlaneLines& lines,
                                             std::span<const PlannedExposure> planned,
                                             const BoardEvidence& evidence, const PlaneRules& rules,
                                             SteadyTime since, const SteadyClock& clock);

}  // namespace symrig
