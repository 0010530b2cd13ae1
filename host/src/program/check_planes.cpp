// SPDX-License-Identifier: Apache-2.0
// The rule projector.planes: a picture shows `planes` bit planes in each refresh, `plane_period` apart.
#include "program/passes.hpp"
#include "program/timing.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::program {
namespace {

constexpr std::string_view kPlanesRule = "projector.planes";

/// true: the profile's planes are usable.
bool check_profile_planes(const RigSetup& rig, Findings& findings) {
  const ProjectorProfile& projector = rig.projector;
  if (projector.planes < 1 || projector.plane_period.count() <= 0) {
    findings.error(
        rig.projector_place, kPlanesRule,
        fmt::format("'{}' shows bit planes, but planes or plane_period is not set", projector.name),
        "planes = 24, plane_period = \"684 us\"");
    return false;
  }
  if (projector.planes * projector.plane_period <= projector.refresh) return true;
  findings.error(
      rig.projector_place, kPlanesRule,
      fmt::format("{} planes of {} do not fit into a refresh of {}", projector.planes,
                  base::duration_text(projector.plane_period), base::duration_text(projector.refresh)),
      fmt::format("plane_period = \"{} us\"", projector.refresh.count() / projector.planes / 1000));
  return false;
}

/// A scan of a file: pattern k is plane k, so the camera must be ready again before the next plane.
void check_file_scan(const RigSetup& rig, const Scan& scan, Findings& findings) {
  const ProjectorProfile& projector = rig.projector;
  const ScanTiming timing(rig, scan);
  const auto planes = static_cast<std::uint64_t>(projector.planes);
  if (scan.pattern_count() > planes)
    findings.error(
        scan.place, kPlanesRule,
        fmt::format("the scan shows {} patterns, but a picture has {} planes", scan.pattern_count(), planes),
        fmt::format("patterns = {}", planes));
  for (const PatternGroup& group : scan.patterns) {
    const Nanoseconds ready = scan.pattern_count() > 1 ? timing.gap() : Nanoseconds{0};
    const Nanoseconds needed = timing.needed_light(scan.bracket_of(group)) + ready;
    if (needed <= projector.plane_period) continue;
    const Nanoseconds room = projector.plane_period - timing.settle() - ready;
    findings.error(scan.bracket_place, kPlanesRule,
                   fmt::format("the exposures of a pattern and the readout need {}, but a plane lasts {}",
                               base::duration_text(needed), base::duration_text(projector.plane_period)),
                   room.count() > 0
                       ? fmt::format("bracket = [\"{}\"]", base::duration_text(room))
                       : std::string("patterns = 1: the camera is not ready again before the next plane"));
  }
}

/// The longest shutter time of an exposure in its planes, with the dark time of the refreshes that it
/// crosses.
Nanoseconds room_of(const PlaneExposure& one, const ProjectorProfile& projector, Nanoseconds settle) {
  const Nanoseconds dark = projector.refresh - projector.planes * projector.plane_period;
  const int refreshes = (one.plane + one.planes - 1) / projector.planes;
  return one.planes * projector.plane_period + refreshes * dark - settle;
}

/// The exposures of a capture: the pattern of each is in `planes` planes.
void check_plane_exposures(const RigSetup& rig, const Scan& scan, Findings& findings) {
  const ProjectorProfile& projector = rig.projector;
  const ScanTiming timing(rig, scan);
  for (const PlaneExposure& one : scan.plane_exposures) {
    if (one.plane < 0 || one.planes < 1 || one.plane >= projector.planes) {
      findings.error(scan.place, kPlanesRule,
                     fmt::format("{} planes from plane {} on do not begin in a picture of {}", one.planes,
                                 one.plane, projector.planes),
                     fmt::format("planes 0 to {}", projector.planes - 1));
    } else if (const Nanoseconds room = room_of(one, projector, timing.settle()); one.exposure > room) {
      findings.error(scan.bracket_place, kPlanesRule,
                     fmt::format("an exposure of {} does not fit into {} planes of {}",
                                 base::duration_text(one.exposure), one.planes,
                                 base::duration_text(projector.plane_period)),
                     fmt::format("at most {}", base::duration_text(room)));
    }
  }
}

}  // namespace

void check_planes(const RigSetup& rig, const Scan& scan, Findings& findings) {
  if (!check_profile_planes(rig, findings)) return;
  if (scan.plane_exposures.empty()) {
    check_file_scan(rig, scan, findings);
  } else {
    check_plane_exposures(rig, scan, findings);
  }
}

}  // namespace symrig::program
