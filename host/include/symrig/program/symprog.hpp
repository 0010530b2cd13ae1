// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/program/compile.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// A compiled program as a file (scan.symprog): its board, the configuration of its lines, and its records.
/// docs/program-file.md gives the bytes.
std::vector<std::uint8_t> symprog_bytes(const CompiledProgram& program);

/// fails: bad_format (not such a file, damaged, of a newer version).
Result<CompiledProgram> read_symprog(std::span<const std::uint8_t> bytes);

/// True if the bytes begin like a compiled program.
bool looks_like_symprog(std::span<const std::uint8_t> bytes);

/// Checks that a board has the lines, tick rate and limits for which the program was compiled.
/// fails: device_refused (the message names the first difference).
Result<void> check_board_fits(const CompiledProgram& program, const BoardInfo& board);

/// Hash of the configuration as the board computes it (PROTOCOL.md). fails: as Board::configure().
Result<std::uint32_t> config_hash(const CompiledProgram& program);

}  // namespace symrig
