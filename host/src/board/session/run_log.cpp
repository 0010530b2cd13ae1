// SPDX-License-Identifier: Apache-2.0
#include "board/session/run_log.hpp"

#include "board/session/names.hpp"

namespace symrig::board {

FaultInfo to_fault(const symrig_wire_Fault& fault) {
  const std::uint32_t code = protocol::raw(fault.code);
  const Explained explained = explain_fault(code);
  return {code, Ticks{fault.tick}, fault.arg, std::string(explained.name), std::string(explained.hint)};
}

void RunLog::open(const Receipt& blank) {
  receipt_ = blank;
  started_ = false;
  finished_ = false;
}

void RunLog::take(const symrig_wire_Event& event) {
  if (event.which_body == symrig_wire_Event_run_started_tag) {
    started_ = true;
    receipt_.started = Ticks{event.body.run_started.tick};
  }
  if (!started_ || finished_) return;  // an event of an earlier run, or between runs
  switch (event.which_body) {
    case symrig_wire_Event_step_mark_tag: {
      const symrig_wire_StepMark& mark = event.body.step_mark;
      receipt_.marks.push_back({mark.id, mark.ordinal, Ticks{mark.tick}});
      if (on_mark) on_mark(receipt_.marks.back());
      return;
    }
    case symrig_wire_Event_edge_tag:
      receipt_.edges.push_back(
          {static_cast<int>(event.body.edge.line), event.body.edge.level, Ticks{event.body.edge.tick}});
      return;
    case symrig_wire_Event_fault_tag:
      receipt_.fault = to_fault(event.body.fault);
      return;
    case symrig_wire_Event_run_done_tag:
      return take_done(event.body.run_done);
    default:
      return;  // RunDone counts EventsLost again; other events come from newer boards
  }
}

void RunLog::take_done(const symrig_wire_RunDone& done) {
  finished_ = true;
  const std::uint32_t end = protocol::raw(done.end);
  receipt_.end = end <= static_cast<std::uint32_t>(RunEnd::fault) ? static_cast<RunEnd>(end) : RunEnd::fault;
  receipt_.actual = Ticks{done.duration};
  receipt_.steps = done.steps;
  receipt_.underruns = done.underruns;
  receipt_.late = done.late;
  receipt_.events_lost = done.events_lost;
}

}  // namespace symrig::board
