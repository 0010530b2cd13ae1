// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"
#include "symrig/program/program_file.hpp"

#include <algorithm>
#include <functional>
#include <vector>

namespace symrig::program {

/// The shortest time from the end of an exposure to the next trigger: the readout minus the allowed overlap.
inline Nanoseconds shortest_gap(const CameraProfile& camera) {
  const Nanoseconds overlap = camera.overlap ? camera.overlap_time_max : Nanoseconds{0};
  return std::max(camera.readout - overlap, Nanoseconds{0});
}

/// The times of a scan, from its file and the device profiles. The checks and the compiler use the same
/// times.
class ScanTiming {
 public:
  ScanTiming(const RigSetup& rig, const Scan& scan) : rig_(rig), scan_(scan) {}

  /// Width of the trigger pulse of an exposure: exposure = width + exposure_offset in trigger-width mode.
  Nanoseconds pulse(Nanoseconds exposure) const {
    const CameraProfile& camera = rig_.camera;
    return camera.mode == ExposureMode::timed ? camera.trigger_pulse : exposure - camera.exposure_offset;
  }
  Nanoseconds gap() const { return scan_.gap.value_or(shortest_gap(rig_.camera)); }
  /// From the pattern to the exposure. A camera that is late by more takes its own time.
  Nanoseconds settle() const {
    return std::max(scan_.settle.value_or(rig_.projector.settle), rig_.camera.trigger_delay);
  }
  /// From the pattern to the camera's trigger: the exposure begins `settle` after the pattern.
  Nanoseconds before_trigger() const { return settle() - rig_.camera.trigger_delay; }

  /// True if the projector makes the pattern by pulses (bit planes), so that only all of them give its
  /// levels.
  bool in_time(const PatternGroup& group) const {
    const int from = rig_.projector.whole_refresh_from_bits;
    return from != 0 && group.bits >= from;
  }
  /// True for a triggered pattern made by pulses: the exposure must include all of it.
  bool around(const PatternGroup& group) const {
    return rig_.projector.sync == PatternSync::trigger && in_time(group);
  }
  Nanoseconds min_on_time(const PatternGroup& group) const {
    const auto limit = rig_.projector.limit_for(group.bits);
    return limit ? limit->time : Nanoseconds{0};
  }
  /// The steady light that is needed after a trigger: settle, all its exposures and their gaps.
  Nanoseconds needed_light() const { return needed_light(scan_.bracket); }
  Nanoseconds needed_light(const std::vector<Nanoseconds>& bracket) const {
    const auto exposures = static_cast<std::int64_t>(bracket.size());
    Nanoseconds sum{0};
    Nanoseconds longest{0};
    for (const Nanoseconds exposure : bracket) {
      sum += exposure;
      longest = std::max(longest, exposure);
    }
    const bool one_each = scan_.advance == Advance::each_exposure || scan_.order == ScanOrder::bracket_outer;
    return settle() + (one_each ? longest : sum + (exposures - 1) * gap());
  }
  /// How long a triggered projector must show a pattern of the group: the needed light and the black after
  /// it.
  Nanoseconds needed_on_time(const PatternGroup& group) const {
    const Nanoseconds light = around(group)
                                  ? Nanoseconds{0}
                                  : needed_light(scan_.bracket_of(group)) + rig_.projector.black_insertion;
    return std::max(light, min_on_time(group));
  }
  Nanoseconds on_time(const PatternGroup& group) const {
    return scan_.on_time.value_or(needed_on_time(group));
  }

 private:
  const RigSetup& rig_;
  const Scan& scan_;
};

/// Makes one exposure legal. The result is never shorter than the shortest legal exposure.
using Legalize = std::function<Nanoseconds(Nanoseconds)>;

/// A legal bracket in the same order, with as many different exposures as possible. Each exposure is made
/// legal by itself. If this makes some equal, all are first multiplied by one factor, so that the shortest is
/// `least`: equal exposures add no range. Exposures that are still equal appear once.
std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least,
                                        const Legalize& legalize);

/// The same if every exposure of at least `least` is legal.
std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least);

}  // namespace symrig::program
