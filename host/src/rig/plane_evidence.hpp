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

/// Why an exposure does not prove its plane. `proved`: plane `at.plane` of a picture with its pattern there
/// was lit from its edge on, and the exposure ended within the planes with its pattern.
enum class PlaneProof : std::uint8_t {
  proved,
  no_exposure,      ///< the line shows no exposure
  no_refresh,       ///< no frame edge before it
  unclear_refresh,  ///< the frame edge fits to no refresh of the screen
  other_picture,    ///< the screen showed a picture with another pattern there
  edges_missing,    ///< the edges since the frame edge are not one a plane
  other_plane       ///< it began in another plane, or ended after its planes
};

/// For messages: "no edge of the vsync line before an exposure".
std::string_view text_of(PlaneProof proof);

/// Proves from the edges that the board captured, and from the screen's flips, in which planes the exposures
/// of a run were taken.
///
/// Between the frame edge before an exposure and its begin there must be exactly plane + 1 plane edges, the
/// first one frame_lead after the frame edge, the others a period apart. A picture's planes begin `latency`
/// refreshes after its scan-out began. So the frame edge names a refresh of the screen, if it comes within
/// 3/8 of a refresh of that moment. `shown` (Projector::played()) tells the picture of this refresh, and of
/// those in which the exposure goes on.
/// fails: as SteadyClock::at().
Result<std::vector<PlaneProof>> prove_planes(const Receipt& receipt, const PlaneLines& lines,
                                             const PlaneSchedule& schedule, const BoardEvidence& evidence,
                                             const PlaneRules& rules, std::span<const ShownPicture> shown,
                                             const SteadyClock& clock);

/// Refreshes in which a picture came late.
std::int64_t late_pictures(std::span<const ShownPicture> shown);

}  // namespace symrig
