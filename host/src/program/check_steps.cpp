// SPDX-License-Identifier: Apache-2.0
#include "program/passes.hpp"
#include "program/timing.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"

#include <cstdlib>
#include <optional>

#include <fmt/format.h>

namespace symrig::program {
namespace {

void check_timeout(Nanoseconds timeout, int place, std::string_view key, const BoardInfo& board,
                   LintFindings& findings) {
  const Ticks ticks = board.rate.ticks(timeout);
  if (ticks.count > 0 && ticks <= board.max_dwell) return;
  const Nanoseconds longest = board.rate.nanoseconds(board.max_dwell);
  findings.error(
      place, "wait.timeout",
      fmt::format("a time-out of {} is outside of the board's range, {} to {}", base::duration_text(timeout),
                  base::duration_text(board.rate.nanoseconds(Ticks{1})), base::duration_text(longest)),
      setting(key, ticks.count == 0 ? Nanoseconds{1'000'000} : longest));
}

void check_rounding(Nanoseconds time, int place, const BoardInfo& board, LintFindings& findings) {
  const Nanoseconds realised = board.rate.nanoseconds(board.rate.ticks(time));
  if (realised.count() == 0 && time.count() != 0)
    return findings.error(
        place, "rounding",
        fmt::format("{} becomes nothing: the board counts in {:.6g} ns", base::duration_text(time),
                    1e9 / static_cast<double>(board.rate.hz)),
        fmt::format("use at least \"{}\"", base::duration_text(board.rate.nanoseconds(board.min_dwell))));
  const std::int64_t off = (realised - time).count();
  if (std::abs(off) * 1000 <= time.count()) return;
  findings.warning(
      place, "rounding",
      fmt::format("{} becomes {} ({:+} ns): the board counts in {:.6g} ns", base::duration_text(time),
                  base::duration_text(realised), off, 1e9 / static_cast<double>(board.rate.hz)),
      fmt::format("use \"{}\"", base::duration_text(realised)));
}

void check_step(const FileStep& step, const RigSetup& rig, const BoardInfo& board, LintFindings& findings) {
  const Nanoseconds least = rig.camera.min_exposure;
  switch (step.kind) {
    case FileStep::Kind::wait:
      return check_timeout(step.time, step.place, "timeout", board, findings);
    case FileStep::Kind::hold:
    case FileStep::Kind::pulse:
      return check_rounding(step.time, step.place, board, findings);
    case FileStep::Kind::expose:
      if (step.time < least || step.time <= rig.camera.exposure_offset)
        findings.error(
            step.place, "camera.min_exposure",
            fmt::format("exposure of {}: the shortest of '{}' is {}", base::duration_text(step.time),
                        rig.camera.name, base::duration_text(least)),
            setting("expose", least));
      return;
    default:
      return;
  }
}

void check_list(const std::vector<FileStep>& steps, const RigSetup& rig, const BoardInfo& board,
                LintFindings& findings) {
  for (const FileStep& step : steps) {
    check_step(step, rig, board, findings);
    check_list(step.steps, rig, board, findings);
  }
}

/// The board cannot make a pulse that is shorter than its shortest word.
void check_pulse(std::string_view key, Nanoseconds width, int place, const BoardInfo& board,
                 LintFindings& findings) {
  const Nanoseconds least = board.rate.nanoseconds(board.min_dwell);
  if (width >= least) return;
  findings.error(place, "trigger_pulse",
                 fmt::format("{} of {}: the board's shortest is {}", key, base::duration_text(width),
                             base::duration_text(least)),
                 setting(key, least));
}

void check_projector(const RigSetup& rig, const BoardInfo& board, LintFindings& findings) {
  const ProjectorProfile& projector = rig.projector;
  const int place = rig.projector_place;
  check_pulse("advance_pulse", projector.advance_pulse, place, board, findings);
  if (projector.sync != PatternSync::vsync) return;
  check_timeout(projector.vsync_timeout, place, "vsync_timeout", board, findings);
  const Nanoseconds refresh = projector.refresh;
  if (refresh.count() == 0) return;
  if (projector.vsync_timeout < refresh)
    findings.error(place, "wait.timeout",
                   fmt::format("a vsync_timeout of {} is shorter than a refresh of {}",
                               base::duration_text(projector.vsync_timeout), base::duration_text(refresh)),
                   setting("vsync_timeout", 3 * refresh));
  if (projector.advance_pulse >= refresh)
    findings.error(
        place, "trigger_pulse",
        fmt::format("advance_pulse of {} is not shorter than a refresh: it would miss the vsync of its "
                    "pattern",
                    base::duration_text(projector.advance_pulse)),
        setting("advance_pulse", refresh / 2));
}

void check_camera(const RigSetup& rig, const BoardInfo& board, LintFindings& findings) {
  if (rig.camera.mode == ExposureMode::timed)
    check_pulse("trigger_pulse", rig.camera.trigger_pulse, rig.camera_place, board, findings);
}

}  // namespace

void check_times(const ProgramFile& file, const BoardInfo& board, LintFindings& findings) {
  check_list(file.steps, file.rig, board, findings);
  if (file.scan || has_step(file.steps, FileStep::Kind::pattern)) check_projector(file.rig, board, findings);
  if (file.scan || has_step(file.steps, FileStep::Kind::expose)) check_camera(file.rig, board, findings);
}

void check_camera_pulses(const ProgramFile& file, const BoardInfo& board, const Timeline& timeline,
                         const std::vector<int>& places, LintFindings& findings) {
  const RigLine* camera = file.rig.with_role(RigRole::camera);
  if (camera == nullptr) return;
  const int line = board.line(camera->config.line);
  const CameraProfile& profile = file.rig.camera;
  const bool width = profile.mode == ExposureMode::trigger_width;
  const Nanoseconds gap = shortest_gap(profile);
  std::optional<Ticks> began;
  std::optional<Ticks> ended;  // end of the exposure, not of the pulse
  for (const PlannedEdge& edge : timeline.edges) {
    if (edge.line != line) continue;
    const int place = places[edge.record];
    if (edge.level != camera->active_low) {
      if (ended && (edge.tick < *ended || board.rate.nanoseconds(edge.tick - *ended) < gap))
        findings.error(
            place, "camera.readout",
            fmt::format("{} from an exposure to this trigger: '{}' needs {}, or it drops the frame "
                        "(overtrigger)",
                        edge.tick < *ended ? "a negative time"
                                           : base::duration_text(board.rate.nanoseconds(edge.tick - *ended)),
                        profile.name, base::duration_text(gap)),
            setting("hold", gap) + " before it");
      began = edge.tick;
    } else if (began && width) {
      const Nanoseconds exposure = board.rate.nanoseconds(edge.tick - *began) + profile.exposure_offset;
      ended = edge.tick + board.rate.ticks(profile.exposure_offset);
      if (exposure < profile.min_exposure)
        findings.error(
            place, "camera.min_exposure",
            fmt::format("exposure of {}: the shortest of '{}' is {}", base::duration_text(exposure),
                        profile.name, base::duration_text(profile.min_exposure)),
            setting("width", profile.min_exposure - profile.exposure_offset));
    }
  }
}

}  // namespace symrig::program
