// SPDX-License-Identifier: Apache-2.0
#include "symrig/device/bracket.hpp"

#include "names.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig::device {
namespace {

Error illegal(std::string what, Nanoseconds alternative) {
  return {ErrorCode::bad_argument, std::move(what),
          "the nearest legal value is " + duration_text(alternative)};
}

/// The next whole number of refresh periods, at least one.
Nanoseconds whole_refreshes(Nanoseconds exposure, Nanoseconds period) {
  const std::int64_t refreshes = std::max<std::int64_t>(1, (exposure + period / 2) / period);
  return refreshes * period;
}

Result<void> check_exposure(const RigProfile& profile, Nanoseconds exposure) {
  if (exposure < profile.min_exposure)
    return illegal(fmt::format("exposure of {}: the camera's shortest is {}", duration_text(exposure),
                               duration_text(profile.min_exposure)),
                   profile.whole_refreshes ? whole_refreshes(profile.min_exposure, profile.refresh_period)
                                           : profile.min_exposure);
  if (!profile.whole_refreshes) return {};
  const Nanoseconds whole = whole_refreshes(exposure, profile.refresh_period);
  if (whole == exposure) return {};
  return illegal(fmt::format("exposure of {} is not whole refresh periods of {}", duration_text(exposure),
                             duration_text(profile.refresh_period)),
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

/// pattern → vsync → settle → (expose → readout) × k
void add_photograph(ProgramBuilder& program, const RigProfile& profile,
                    std::span<const Nanoseconds> exposures) {
  program.mark(kMarkPattern)
      .pulse(profile.projector_line, profile.advance_pulse)
      .wait_edge(profile.vsync_line, EdgeKind::rising, profile.vsync_timeout, OnTimeout::abort)
      .hold(profile.settle);
  for (std::size_t j = 0; j < exposures.size(); ++j)
    program.mark(mark_of_exposure(j)).pulse(profile.camera_line, exposures[j]).hold(profile.readout);
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
  program.loop(photographs);
  add_photograph(program, profile, exposures);
  return program.end_loop().end();
}

Result<Program> compile_brackets(const BoardInfo& board, const RigProfile& profile,
                                 std::span<const std::vector<Nanoseconds>> brackets) {
  SYMRIG_CHECK(check_profile(board, profile));
  ProgramBuilder program(board);
  for (const auto& exposures : brackets) {
    SYMRIG_CHECK(check_bracket(profile, exposures));
    add_photograph(program, profile, exposures);
  }
  return program.end();
}

}  // namespace symrig::device
