// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/evidence.hpp"
#include "symrig/base/result.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/projector/projector.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace symrig {

/// An exposure that is to be taken.
struct WantedExposure {
  std::size_t photograph = 0;  ///< also the index of its pattern
  std::size_t exposure = 0;    ///< within the photograph's bracket
  Nanoseconds time{0};
};

/// An exposure with its planes. Its light is `what.time`. The shutter (`at.exposure`) is open for longer if
/// the exposure goes on in the next picture: then it includes the dark time between refreshes.
struct PlannedExposure {
  WantedExposure what;
  PlaneExposure at;
};

/// The pictures of one run of the board, and the exposures that are taken meanwhile, in order of time.
struct PlaneSchedule {
  std::vector<PlanePlan> pictures;
  std::vector<std::size_t> order;  ///< [refresh of the run]: its picture
  std::vector<PlannedExposure> exposures;

  /// The pattern that plane `plane` of a picture shows, or kBlackPlane.
  int pattern(std::size_t picture, int plane) const;
};

/// The times that a schedule must keep.
struct PlaneRules {
  PlaneTiming timing;
  Nanoseconds refresh{0};
  Nanoseconds settle{0};   ///< from a plane's edge to the exposure
  Nanoseconds gap{0};      ///< from the end of an exposure to the next trigger,
  Nanoseconds overlap{0};  ///< less this at most, as rig::overlap_before() allows
  int hold = 1;            ///< refreshes from picture to picture, if the screen cannot change it in each
  bool crosses = true;     ///< an exposure may go on in the next picture, if may_cross() allows it
  /// From a plane's edge to the board's next word, at most. A board whose edges software makes needs it.
  Nanoseconds reaction{0};
  Nanoseconds first{0};  ///< from the first frame edge to the first plane that the board can wait for

  /// From the last plane of a picture to plane 0 of the next one.
  Nanoseconds dark() const { return refresh - timing.planes * timing.period; }
  /// true: neighbouring planes of one pattern are one light.
  bool one_light() const { return timing.exposure == timing.period; }
  /// The light of an exposure that goes on in the next picture is the shutter's time without the dark time
  /// between refreshes. It must not end there. A picture with one plane leaves no choice where an exposure
  /// ends.
  bool may_cross() const { return crosses && one_light() && timing.planes > 1; }
};

/// The longest exposure in the planes of one picture. fails: limit (a plane is shorter than its settling).
Result<Nanoseconds> longest_in_planes(const PlaneRules& rules);

/// The longest exposure in a single plane. Not positive: a plane is shorter than its settling.
Nanoseconds longest_in_one_plane(const PlaneRules& rules);

/// Schedules exposures in the order of their photographs, each as soon as the camera is ready.
///
/// An exposure begins in the first plane after that. Its pattern gets as many planes as it needs, also those
/// of the pictures that follow, also if the board begins late by `reaction`. All other planes are black. So
/// the camera sets the pace: pictures change at any refresh, and no exposure waits for another picture. With
/// hold > 1, an exposure takes the first planes that are still free, or that have its pattern already. fails:
/// limit (an exposure is longer than longest_in_planes(), and may not go on in the next picture).
Result<PlaneSchedule> plan_planes(std::span<const WantedExposure> wanted, const PlaneRules& rules);

/// An exposure in a single plane of a picture that lights some of its planes.
struct PlaneShot {
  int plane = 0;
  std::uint32_t lit = 0;  ///< bit k: plane k is bright
  bool is_lit() const { return (lit >> static_cast<unsigned>(plane) & 1U) != 0; }
};

/// Schedules shots, with black pictures where no shot is. Shots one after the other that light the same
/// planes share a picture if the camera is ready in time, others have pictures of their own.
/// `what.photograph` of an exposure is the number of its shot, and its pattern. The other bright planes of
/// its picture show the pattern `bright`. `wanted` are the shots to take, none longer than
/// longest_in_one_plane().
PlaneSchedule plan_shots(std::span<const PlaneShot> shots, std::span<const WantedExposure> wanted, int bright,
                         const PlaneRules& rules);

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
