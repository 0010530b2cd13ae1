// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program_structure.hpp"
#include "symrig/protocol/program_timing.hpp"

namespace symrig::protocol {

/// Checks a program against the rules of a board. The host's linter uses it, and the firmware at commit.
/// Sink: bool(const Violation&), called for each violation; false ends the search. The work is bounded by the
/// number of records (at most 17 readings each) for any number of rounds, and can be done in slices.
template <class Sink>
class ProgramCheck {
 public:
  /// rules and sink must outlive the check.
  ProgramCheck(const ProgramRules& rules, Sink& sink) : structure_(rules, sink), time_(rules, sink) {}

  /// Begins again, with the present rules and sink.
  void restart() {
    structure_.restart();
    time_.restart();
    structured_ = false;
    done_ = false;
  }

  /// Reads up to `looks` records. true: done.
  bool advance(ProgramView program, uint32_t looks) {
    if (done_) return true;
    if (!structured_) {
      structured_ = structure_.advance(program, looks);
      done_ = structured_ && !structure_.sound();
    } else {
      done_ = time_.advance(program, looks);
    }
    return done_;
  }

  bool sound() const { return done_ && structure_.sound() && time_.sound(); }
  // Valid if sound().
  const ProgramTiming& timing() const { return time_.timing(); }
  const LineUse& use(unsigned line) const { return time_.use(line); }

 private:
  StructureCheck<Sink> structure_;
  TimingCheck<Sink> time_;
  bool structured_ = false;
  bool done_ = false;
};

/// The same in one call. Fills in the timing if there is no violation.
template <class Sink>
bool check_program(ProgramView program, const ProgramRules& rules, ProgramTiming& timing, Sink&& sink) {
  ProgramCheck<Sink> check(rules, sink);
  while (!check.advance(program, UINT32_MAX)) {
  }
  if (check.sound()) timing = check.timing();
  return check.sound();
}

}  // namespace symrig::protocol
