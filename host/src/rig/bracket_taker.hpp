// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/board_runs.hpp"
#include "rig/pacing.hpp"
#include "symrig/base/result.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig {

/// Takes brackets until every frame is certain: repeats doubtful ones, and recovers lost devices.
class BracketTaker {
 public:
  /// options must outlive this object.
  BracketTaker(std::unique_ptr<DeviceSet> devices, const RigOptions& options)
      : runs_(std::move(devices), options) {}

  /// As BoardRuns::open().
  Result<void> open() { return runs_.open(); }

  /// Takes a bracket for each pattern; exposures[i] belongs to pattern i.
  /// fails: frame_missing (a photograph was in doubt after all retakes; the message describes its frames),
  /// fault (of the board), device errors from which the rig cannot recover.
  Result<std::vector<TakenBracket>> take(std::span<const Pattern> patterns,
                                         std::span<const Exposures> exposures);
  /// The same for a projector with bit planes, with another schedule than plan_planes().
  Result<std::vector<TakenBracket>> take(std::span<const Pattern> patterns,
                                         std::span<const Exposures> exposures, PlaneScheduler planner);

  /// The camera's sequence numbers jump: frames of an earlier run of symrig are between.
  void forget_numbers() { runs_.forget_numbers(); }

  const Camera& camera() const { return runs_.devices().camera(); }
  const Projector& projector() const { return runs_.devices().projector(); }
  /// The camera's timing, with what the projector's bit planes allow.
  Result<CameraTiming> timing() const;
  /// What the projector's planes and the camera allow.
  PlaneRules plane_rules() const { return planes_.rules(); }
  const RigTrouble& trouble() const { return runs_.trouble(); }
  /// Each warning once: planes are checked again whenever the projector was opened again.
  void warn(std::string what) {
    auto& all = runs_.trouble().warnings;
    if (std::ranges::find(all, what) == all.end()) all.push_back(std::move(what));
  }
  void doubt_exposures(std::string how) { runs_.trouble().exposures = std::move(how); }
  std::int64_t frames() const { return runs_.frames(); }      ///< exposures that the camera made
  double rig_seconds() const { return runs_.rig_seconds(); }  ///< run time of the board's programs
  RigTime time() const { return runs_.time(); }

 private:
  PatternPacing& pacing();
  Result<void> recover(const Error& error);

  BoardRuns runs_;
  TriggeredPacing triggered_{runs_};
  ShownPacing shown_{runs_};
  PlanePacing planes_{runs_};
  std::array<PatternPacing*, 3> pacings_{&triggered_, &shown_, &planes_};
};

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
