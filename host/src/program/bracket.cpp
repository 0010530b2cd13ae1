// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/bracket.hpp"

#include "base/duration.hpp"
#include "board/session/names.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
namespace {

Error illegal(std::string what, Nanoseconds alternative) {
  return {ErrorCode::bad_argument, std::move(what),
          "the nearest legal value is " + base::duration_text(alternative)};
}

/// The next whole number of refresh periods, at least one.
Nanoseconds whole_refreshes(Nanoseconds exposure, Nanoseconds period) {
  const std::int64_t refreshes = std::max<std::int64_t>(1, (exposure + period / 2) / period);
  return refreshes * period;
}

Result<void> check_exposure(const RigProfile& profile, Nanoseconds exposure) {
  const Nanoseconds least = std::max(profile.min_exposure, profile.exposure_offset + Nanoseconds{1});
  if (exposure < least)
    return illegal(fmt::format("exposure of {}: the camera's shortest is {}", base::duration_text(exposure),
                               base::duration_text(least)),
                   profile.whole_refreshes ? whole_refreshes(least, profile.refresh_period) : least);
  if (!profile.whole_refreshes) return {};
  const Nanoseconds whole = whole_refreshes(exposure, profile.refresh_period);
  if (whole == exposure) return {};
  return illegal(fmt::format("exposure of {} is not whole refresh periods of {}",
                             base::duration_text(exposure), base::duration_text(profile.refresh_period)),
                 whole);
}

Result<void> check_profile(const BoardInfo& board, const RigProfile& profile) {
  const Nanoseconds shortest = board.rate.nanoseconds(board.min_dwell);
  if (profile.refresh_period.count() <= 0)
    return illegal("refresh_period is not positive", Nanoseconds{16'666'667});
  if (profile.advance_pulse < shortest)
    return illegal("advance_pulse is shorter than the board's shortest hold", shortest);
  if (profile.advance_pulse >= profile.refresh_period)
    return illegal("advance_pulse is as long as a refresh: it would miss the vsync that it asks for",
                   profile.refresh_period / 2);
  if (profile.settle < shortest) return illegal("settle is shorter than the board's shortest hold", shortest);
  if (profile.readout < shortest)
    return illegal("readout is shorter than the board's shortest hold", shortest);
  if (profile.vsync_timeout < profile.refresh_period)
    return illegal("vsync_timeout is shorter than a refresh", 3 * profile.refresh_period);
  return {};
}

/// A pulse of a line that may be on when low.
void add_pulse(ProgramBuilder& program, const std::string& line, bool active_low, Nanoseconds width) {
  program.set(line, !active_low).hold(width).set(line, active_low);
}

/// Lines that are on when low go off before the first photograph, long enough for the camera to notice.
void begin_off(ProgramBuilder& program, const RigProfile& profile) {
  if (profile.camera_active_low) program.set(profile.camera_line, true);
  const bool projector = profile.projector_active_low && !profile.projector_line.empty();
  if (projector) program.set(profile.projector_line, true);
  if (profile.camera_active_low || projector) program.hold(profile.readout);
}

/// pattern → vsync → settle → (expose → readout) × k
void add_photograph(ProgramBuilder& program, const RigProfile& profile,
                    std::span<const Nanoseconds> exposures) {
  program.mark(kMarkPattern);
  if (!profile.projector_line.empty())
    add_pulse(program, profile.projector_line, profile.projector_active_low, profile.advance_pulse);
  if (!profile.vsync_line.empty())
    program.wait_edge(profile.vsync_line, EdgeKind::rising, profile.vsync_timeout, OnTimeout::abort);
  program.hold(profile.settle);
  for (std::size_t j = 0; j < exposures.size(); ++j) {
    program.mark(mark_of_exposure(j));
    add_pulse(program, profile.camera_line, profile.camera_active_low,
              exposures[j] - profile.exposure_offset);
    program.hold(profile.readout);
  }
}

Result<void> check_bracket(const RigProfile& profile, std::span<const Nanoseconds> exposures) {
  if (exposures.empty())
    return Error{ErrorCode::bad_argument, "a bracket has no exposures", "give at least one"};
  for (const Nanoseconds exposure : exposures) SYMRIG_CHECK(check_exposure(profile, exposure));
  return {};
}

}  // namespace

Result<Program> compile_bracket(const BoardInfo& board, const RigProfile& profile,
                                std::span<const Nanoseconds> exposures, std::uint32_t photographs) {
  SYMRIG_CHECK(check_profile(board, profile));
  SYMRIG_CHECK(check_bracket(profile, exposures));
  ProgramBuilder program(board);
  begin_off(program, profile);
  program.loop(photographs);
  add_photograph(program, profile, exposures);
  return program.end_loop().end();
}

Result<Program> compile_brackets(const BoardInfo& board, const RigProfile& profile,
                                 std::span<const std::vector<Nanoseconds>> brackets) {
  SYMRIG_CHECK(check_profile(board, profile));
  ProgramBuilder program(board);
  begin_off(program, profile);
  for (const auto& exposures : brackets) {
    SYMRIG_CHECK(check_bracket(profile, exposures));
    add_photograph(program, profile, exposures);
  }
  return program.end();
}

}  // namespace symrig
