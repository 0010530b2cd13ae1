// SPDX-License-Identifier: Apache-2.0
// The rule projector.planes: a picture shows `planes` bit planes in each refresh, `plane_period` apart.
#include "program/passes.hpp"
#include "program/timing.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/hdr/bracket_plan.hpp"

#include <algorithm>
#include <cstdlib>
#include <set>

#include <fmt/format.h>

namespace symrig::program {
namespace {

constexpr std::string_view kPlanesRule = "projector.planes";

/// true: the profile's planes are usable.
bool check_profile_planes(const RigSetup& rig, LintFindings& findings) {
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
void check_file_scan(const RigSetup& rig, const Scan& scan, LintFindings& findings) {
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
void check_plane_exposures(const RigSetup& rig, const Scan& scan, LintFindings& findings) {
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

void check_planes(const RigSetup& rig, const Scan& scan, LintFindings& findings) {
  if (!check_profile_planes(rig, findings)) return;
  if (scan.plane_exposures.empty()) {
    check_file_scan(rig, scan, findings);
  } else {
    check_plane_exposures(rig, scan, findings);
  }
}

namespace {

class ScanCheck {
 public:
  ScanCheck(const RigSetup& rig, const Scan& scan, const BoardInfo& board, LintFindings& findings)
      : rig_(rig), scan_(scan), timing_(rig, scan), board_(board), findings_(findings) {}

  void run() {
    check_bracket();
    check_startup();
    check_gap();
    check_settle();
    check_beat();
    for (const PatternGroup& group : scan_.patterns) check_group(group);
    check_lamp();
    check_marker();
  }

 private:
  // Camera.

  /// The board's shortest pulse also limits exposures.
  Nanoseconds min_exposure() const {
    const CameraProfile& camera = rig_.camera;
    if (camera.mode == ExposureMode::timed) return camera.min_exposure;
    return std::max(camera.min_exposure, camera.exposure_offset + board_.rate.nanoseconds(board_.min_dwell));
  }

  void check_bracket() {
    const Nanoseconds least = min_exposure();
    const std::vector<Nanoseconds> legal = longer_bracket(scan_.bracket, least);
    std::set<Nanoseconds> seen;
    for (const Nanoseconds exposure : scan_.bracket) {
      if (exposure < least)
        findings_.error(
            scan_.bracket_place, "camera.min_exposure",
            fmt::format("exposure of {}: the shortest of '{}' is {}", base::duration_text(exposure),
                        rig_.camera.name, base::duration_text(least)),
            bracket_setting(legal));
      if (!seen.insert(exposure).second) duplicate(exposure);
      check_rounding(exposure);
    }
    check_overlap();
  }

  void duplicate(Nanoseconds exposure) {
    std::vector<Nanoseconds> once;
    for (const Nanoseconds each : scan_.bracket)
      if (std::find(once.begin(), once.end(), each) == once.end()) once.push_back(each);
    findings_.warning(
        scan_.bracket_place, "bracket.duplicate",
        fmt::format("the bracket contains the exposure {} more than once", base::duration_text(exposure)),
        bracket_setting(once));
  }

  void check_rounding(Nanoseconds exposure) {
    if (rig_.camera.mode == ExposureMode::timed || exposure < min_exposure()) return;
    const Nanoseconds offset = rig_.camera.exposure_offset;
    const Nanoseconds realised = board_.rate.nanoseconds(board_.rate.ticks(exposure - offset)) + offset;
    const std::int64_t off = std::abs((realised - exposure).count());
    if (off * 1000 <= exposure.count()) return;
    findings_.warning(scan_.bracket_place, "rounding",
                      fmt::format("exposure of {} becomes {} ({:+} ns): the board counts in {:.6g} ns",
                                  base::duration_text(exposure), base::duration_text(realised),
                                  (realised - exposure).count(), 1e9 / static_cast<double>(board_.rate.hz)),
                      fmt::format("use \"{}\"", base::duration_text(realised)));
  }

  void check_startup() {
    if (!scan_.startup || scan_.startup->exposure >= min_exposure()) return;
    findings_.error(scan_.startup->place, "camera.min_exposure",
                    fmt::format("start-up exposure of {}: the shortest of '{}' is {}",
                                base::duration_text(scan_.startup->exposure), rig_.camera.name,
                                base::duration_text(min_exposure())),
                    setting("exposure", min_exposure()));
  }

  /// The camera drops an exposure that begins during a readout and ends before it.
  void check_overlap() {
    const CameraProfile& camera = rig_.camera;
    const Nanoseconds shortest = *std::min_element(scan_.bracket.begin(), scan_.bracket.end());
    if (!camera.overlap || camera.overlap_time_max <= shortest) return;
    findings_.error(
        rig_.camera_place, "camera.overlap",
        fmt::format("overlap_time_max of {} is longer than the shortest exposure, {}: the exposure "
                    "would end before the last frame's readout",
                    base::duration_text(camera.overlap_time_max), base::duration_text(shortest)),
        setting("overlap_time_max", shortest));
  }

  void check_gap() {
    // Without a gap, two pulses would be one.
    const Nanoseconds least = std::max(shortest_gap(rig_.camera), board_.rate.nanoseconds(board_.min_dwell));
    if (scan_.gap.value_or(least) >= least) return;
    findings_.error(
        scan_.gap_place, "camera.readout",
        fmt::format("{} from an exposure to the next trigger: '{}' needs {}, or it drops the "
                    "frame (overtrigger)",
                    base::duration_text(timing_.gap()), rig_.camera.name, base::duration_text(least)),
        setting("gap", least));
  }

  // Projector.

  void check_settle() {
    const ProjectorProfile& projector = rig_.projector;
    if (timing_.settle() >= projector.settle) return;
    const bool assumed = std::find(projector.assumptions.begin(), projector.assumptions.end(), "settle") !=
                         projector.assumptions.end();
    findings_.add(assumed ? Severity::warning : Severity::error, scan_.settle_place, "settle",
                  fmt::format("exposures begin {} after the pattern, but '{}' needs {} until it is steady",
                              base::duration_text(timing_.settle()), projector.name,
                              base::duration_text(projector.settle)),
                  setting("settle", projector.settle));
  }

  /// With a colour wheel or a pulsed lamp, the light of an exposure depends on when it begins.
  void check_beat() {
    const Nanoseconds period = rig_.projector.light_period;
    if (period.count() == 0) return;
    std::vector<Nanoseconds> legal;
    std::string worst;
    double most = 0;
    for (const Nanoseconds exposure : scan_.bracket) {
      const auto beat = forecast_beat(exposure, period);
      if (!beat) return;
      legal.push_back(beat->beats() ? beat->nearest_whole : exposure);
      if (!beat->beats() || beat->spread <= most) continue;
      most = beat->spread;
      worst = beat->to_string(exposure, period);
    }
    if (worst.empty()) return;
    legal.erase(std::unique(legal.begin(), legal.end()), legal.end());
    findings_.warning(scan_.bracket_place, "projector.beat", worst, bracket_setting(legal));
  }

  void check_group(const PatternGroup& group) {
    if (timing_.in_time(group)) check_whole(group);
    if (rig_.projector.sync == PatternSync::trigger) check_on_time(group);
  }

  void check_whole(const PatternGroup& group) {
    if (timing_.around(group)) return check_around(group);
    const Nanoseconds refresh = rig_.projector.refresh;
    if (refresh.count() == 0) return;
    const auto whole = [refresh](Nanoseconds exposure) {
      return std::max<std::int64_t>(1, (exposure + refresh / 2) / refresh) * refresh;
    };
    // A thousandth of a refresh is allowed: it changes grey levels by at most the same share.
    const auto broken = [&](Nanoseconds exposure) {
      return std::abs((exposure - whole(exposure)).count()) * 1000 > refresh.count();
    };
    if (std::none_of(scan_.bracket.begin(), scan_.bracket.end(), broken)) return;
    const std::vector<Nanoseconds> legal = longer_bracket(scan_.bracket, refresh, whole);
    findings_.error(
        scan_.bracket_place, "projector.whole_refresh",
        fmt::format("the projector makes patterns of {} bits by pulses within each refresh of {}: "
                    "an exposure that is not whole refreshes sees wrong grey levels",
                    group.bits, base::duration_text(refresh)),
        bracket_setting(legal));
  }

  void check_around(const PatternGroup& group) {
    const bool several = scan_.bracket.size() > 1 && scan_.order == ScanOrder::pattern_outer;
    if (several && scan_.advance == Advance::each_pattern)
      return findings_.error(
          scan_.bracket_place, "projector.whole_refresh",
          fmt::format("the projector shows a pattern of {} bits once after its trigger: each exposure of the "
                      "bracket needs its own trigger",
                      group.bits),
          "advance = \"exposure\"");
    // The projector's pulse begins when the exposure has begun, and ends before the camera's pulse does.
    const Nanoseconds pattern = rig_.projector.trigger_delay + timing_.on_time(group);
    const Nanoseconds pulses = rig_.camera.mode == ExposureMode::timed
                                   ? Nanoseconds{0}
                                   : rig_.camera.trigger_delay + rig_.projector.advance_pulse;
    const Nanoseconds least =
        std::max(pattern, pulses) + board_.rate.nanoseconds(board_.min_dwell + Ticks{1});
    if (*std::min_element(scan_.bracket.begin(), scan_.bracket.end()) >= least) return;
    const std::vector<Nanoseconds> legal = longer_bracket(scan_.bracket, least);
    findings_.error(
        scan_.bracket_place, "projector.whole_refresh",
        fmt::format("a pattern of {} bits is complete only after {} on the screen, and begins {} after "
                    "the trigger: exposures must include all of it",
                    group.bits, base::duration_text(timing_.on_time(group)),
                    base::duration_text(rig_.projector.trigger_delay)),
        bracket_setting(legal));
  }

  void check_on_time(const PatternGroup& group) {
    const auto limit = rig_.projector.limit_for(group.bits);
    if (!limit && !rig_.projector.min_exposure.empty())
      findings_.warning(
          group.place, "projector.min_exposure",
          fmt::format("'{}' has no limit for patterns of {} bits", rig_.projector.name, group.bits),
          "min_exposure in [rig.projector]");
    const Nanoseconds needed = timing_.needed_on_time(group);
    if (!scan_.on_time) {
      findings_.note(group.place, "projector.on_time",
                     fmt::format("'{}' must show each pattern of {} bits for {}", rig_.projector.name,
                                 group.bits, base::duration_text(needed)),
                     setting("on_time", needed));
    } else if (limit && *scan_.on_time < limit->time) {
      findings_.error(
          scan_.on_time_place, "projector.min_exposure",
          fmt::format("on_time is {}, but '{}' shows patterns of {} bits for at least {}{}",
                      base::duration_text(*scan_.on_time), rig_.projector.name, group.bits,
                      base::duration_text(limit->time),
                      limit->bits == group.bits ? "" : fmt::format(" (its limit for {} bits)", limit->bits)),
          setting("on_time", needed));
    } else if (*scan_.on_time < needed) {
      findings_.error(
          scan_.on_time_place, "projector.black_insertion",
          fmt::format(
              "exposures end {0} after the pattern begins, but the last {2} of its on_time of {1} are black",
              base::duration_text(timing_.needed_light()), base::duration_text(*scan_.on_time),
              base::duration_text(rig_.projector.black_insertion)),
          setting("on_time", needed));
    }
  }

  // Lamp and marker.

  void check_lamp() {
    const RigLine* lamp = scan_.lamp.empty() ? nullptr : rig_.find(scan_.lamp);
    if (lamp == nullptr || lamp->config.max_on.count() == 0) return;
    if (timing_.needed_light() <= lamp->config.max_on) return;
    std::string fix = scan_.advance == Advance::each_pattern && scan_.bracket.size() > 1
                          ? "advance = \"exposure\", or " + fitting_bracket(lamp->config.max_on)
                          : fitting_bracket(lamp->config.max_on);
    findings_.error(
        scan_.lamp_place, "lamp.limit",
        fmt::format("line '{}' would be on for {} with each pattern, but its max_on is {}", scan_.lamp,
                    base::duration_text(timing_.needed_light()), base::duration_text(lamp->config.max_on)),
        std::move(fix));
  }

  /// The shortest exposures of the bracket that fit together into the lamp's max_on.
  std::string fitting_bracket(Nanoseconds max_on) const {
    std::vector<Nanoseconds> sorted = scan_.bracket;
    std::sort(sorted.begin(), sorted.end());
    Nanoseconds on = timing_.settle();
    std::size_t fit = 0;
    while (fit < sorted.size() && on + sorted[fit] <= max_on) on += sorted[fit++] + timing_.gap();
    sorted.resize(fit);
    return fit == 0 ? "a shorter settle and bracket" : bracket_setting(sorted);
  }

  void check_marker() {
    if (!scan_.start_marker) return;
    const StartMarker& marker = *scan_.start_marker;
    const RigLine* line = rig_.find(marker.line);
    const RigRole role = line == nullptr ? RigRole::general : line->role;
    const RigLine* projector = rig_.with_role(RigRole::projector);
    const std::string fix = projector == nullptr ? "" : fmt::format("line = \"{}\"", projector->config.line);
    if (role == RigRole::camera && rig_.camera.mode == ExposureMode::trigger_width) {
      findings_.error(
          marker.place, "marker.exposure",
          fmt::format("'{}' exposes while line '{}' is on: a longer first pulse would lengthen the "
                      "exposure",
                      rig_.camera.name, marker.line),
          fix);
    } else if (role != RigRole::camera && role != RigRole::projector) {
      findings_.error(
          marker.place, "marker.exposure",
          fmt::format("line '{}' is neither the camera's nor the projector's: it has no pulses to lengthen",
                      marker.line),
          fix);
    }
  }

  const RigSetup& rig_;
  const Scan& scan_;
  ScanTiming timing_;
  const BoardInfo& board_;
  LintFindings& findings_;
};

}  // namespace

void check_scan(const RigSetup& rig, const Scan& scan, const BoardInfo& board, LintFindings& findings) {
  if (rig.projector.sync == PatternSync::plane) check_planes(rig, scan, findings);
  if (!scan.bracket.empty()) ScanCheck(rig, scan, board, findings).run();
  // A group with a bracket of its own is judged as a scan of this group alone.
  for (const PatternGroup& group : scan.patterns) {
    if (group.bracket.empty()) continue;
    Scan alone = scan;
    alone.patterns = {group};
    alone.bracket = group.bracket;
    ScanCheck(rig, alone, board, findings).run();
  }
}

}  // namespace symrig::program
