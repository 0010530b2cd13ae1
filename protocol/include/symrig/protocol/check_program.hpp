// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program_structure.hpp"
#include "symrig/protocol/program_timing.hpp"

namespace symrig::protocol {

/// The rules of a board, applied to a program: by the firmware at commit and by the host's linter before
/// that. Sink: bool(const Violation&), called for each breach; false ends the search. Timing is filled in if
/// there is none. Work is bounded by the number of records (16 looks each), whatever the loops' rounds.
template <class Sink>
bool check_program(ProgramView program, const ProgramRules& rules, ProgramTiming& timing, Sink&& sink) {
  StructureCheck<Sink> structure(rules, sink);
  if (!structure.run(program)) return false;
  TimingCheck<Sink> time(rules, sink);
  if (!time.run(program)) return false;
  timing = time.timing();
  return true;
}

}  // namespace symrig::protocol
