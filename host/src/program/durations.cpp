// SPDX-License-Identifier: Apache-2.0
#include "program/passes.hpp"
#include "symrig/board/internal/board_forms.hpp"
#include "symrig/protocol/check_program.hpp"

namespace symrig::program {

void fill_durations(CompiledProgram& compiled) {
  const auto config = board::line_setup(compiled.board, compiled.lines);
  if (!config) return;
  protocol::ProgramTiming timing;
  protocol::check_program({{compiled.program.bytes().data(), compiled.program.bytes().size()}},
                          board::program_rules(compiled.board, *config), timing,
                          [](const protocol::Violation&) { return false; });
  compiled.steps = timing.steps;
  compiled.shortest = compiled.board.rate.nanoseconds(Ticks{timing.min});
  compiled.longest = compiled.board.rate.nanoseconds(Ticks{timing.max});
  compiled.expected = compiled.shortest;
}

}  // namespace symrig::program
