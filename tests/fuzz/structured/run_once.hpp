// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/program/compile.hpp"
#include "symrig/run/run.hpp"
#include "symrig/sim/sim_rig.hpp"

#include <gtest/gtest.h>

namespace symrig::structured {

/// A scan of a few patterns, with waits, loops and a lamp.
constexpr const char* kProgram = R"(symrig = 1
[rig.lines.lamp_enable]
role = "lamp"
max_on = "2 s"
[program]
patterns = 3
bracket = ["1 ms", "4 ms"]
lamp = "lamp_enable"
)";

inline RunRecord run_once() {
  const auto file = parse_program_file(kProgram, "scan.toml", "");
  EXPECT_TRUE(file.ok()) << file.error().line();
  BoardOptions options;
  options.keep_alive = file->rig.keep_alive;
  auto board = Board::connect(make_sim_rig(wiring_of(file->rig)), options);
  EXPECT_TRUE(board.ok());
  const auto compilation = compile_program(*file, board->info());
  EXPECT_TRUE(compilation.ok());
  auto record = run_program(*board, *compilation.program);
  EXPECT_TRUE(record.ok()) << record.error().line();
  return *std::move(record);
}

}  // namespace symrig::structured
