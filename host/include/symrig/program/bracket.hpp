// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/program/program_file.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig {

/// Mark ids of compiled brackets: 0 when a pattern is asked for, 1 + j when exposure j begins.
inline constexpr std::uint32_t kMarkPattern = 0;
constexpr std::uint32_t mark_of_exposure(std::size_t j) {
  return static_cast<std::uint32_t>(1 + j);
}

/// The scan of one batch of photographs, as a capture asks for it: brackets[i] holds the exposures of
/// photograph i, and equal neighbours share a group. The scan asks only the lines that a rig has
/// (Scan::lines_as_wired). gap: from the end of an exposure to the next trigger; none: the camera's shortest.
Scan scan_of_brackets(std::span<const std::vector<Nanoseconds>> brackets,
                      std::optional<Nanoseconds> gap = {});

/// Compiles that scan for a board with compile_program().
/// fails: bad_argument (no photographs, an empty bracket, or the first error that the linter finds: what it
/// found, with the nearest legal value as the hint), unknown_name (the board has no such line).
Result<CompiledProgram> compile_brackets(const RigSetup& rig, const BoardInfo& board,
                                         std::span<const std::vector<Nanoseconds>> brackets,
                                         std::optional<Nanoseconds> gap = {});

/// How long before its plane an exposure waits for the plane's edge.
constexpr Nanoseconds plane_lead(Nanoseconds period) {
  return period / 4;
}

/// Compiles exposures in bit planes (rig.projector.sync = plane). The program waits for
/// the vsync line once. Then it waits for the edge of each exposure's plane, a quarter of a plane before it
/// is due, so that an edge of another plane cannot be taken for it. If the edge does not come, the program
/// goes on: the receipt then lacks the edge. Exposure i has the marks of photograph i with one exposure.
/// fails: as compile_brackets().
Result<CompiledProgram> compile_planes(const RigSetup& rig, const BoardInfo& board,
                                       std::span<const PlaneExposure> exposures,
                                       std::optional<Nanoseconds> gap = {});

}  // namespace symrig
