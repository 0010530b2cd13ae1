// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/program_structure.hpp"
#include "symrig/protocol/program_timing.hpp"

namespace symrig::protocol {

/// The rules of a board, applied to a program: by the firmware at commit and by the host's linter before
/// that. Sink: bool(const Violation&), called for each breach; false ends the search. Work is bounded by the
/// number of records (17 looks each), whatever the loops' rounds, and can be done in slices.
template <class Sink>
class ProgramCheck {
 public:
  /// rules and sink outlive the check.
  ProgramCheck(const ProgramRules& rules, Sink& sink) : structure_(rules, sink), time_(rules, sink) {}

  /// Begins again, with what rules and sink are now.
  void restart() {
    structure_.restart();
    time_.restart();
    structured_ = false;
    done_ = false;
  }

  /// Looks at up to `looks` records. true: done.
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
  // Meaningful if sound().
  const ProgramTiming& timing() const { return time_.timing(); }
  const LineUse& use(unsigned line) const { return time_.use(line); }

 private:
  StructureCheck<Sink> structure_;
  TimingCheck<Sink> time_;
  bool structured_ = false;
  bool done_ = false;
};

/// The same in one go. Timing is filled in if nothing is found.
template <class Sink>
bool check_program(ProgramView program, const ProgramRules& rules, ProgramTiming& timing, Sink&& sink) {
  ProgramCheck<Sink> check(rules, sink);
  while (!check.advance(program, UINT32_MAX)) {
  }
  if (check.sound()) timing = check.timing();
  return check.sound();
}

}  // namespace symrig::protocol
