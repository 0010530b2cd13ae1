// SPDX-License-Identifier: Apache-2.0
// The board keeps events until the host acknowledges them.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <algorithm>
#include <array>
#include <set>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;
using protocol::Kind;

constexpr std::uint32_t kMarks = 6;

/// Starts a run of kMarks marks.
Verdict begin_marks(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(pack({loop(kMarks), mark(3), word(0, board.word()), end_loop(), end()})));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  board.session.forget();
  return code_is("start", symrig_wire_Code_CODE_OK, board.start());
}

std::set<std::uint16_t> numbers(const BoardUnderTest& board) {
  std::set<std::uint16_t> found;
  for (const Received& frame : board.session.frames())
    if (frame.header.kind == Kind::event) found.insert(frame.header.seq);
  return found;
}

/// run_started, the marks and run_done come in order, and their numbers have no gaps.
Verdict in_order(BoardUnderTest& board) {
  const std::uint16_t first = board.session.ack;
  SYMRIG_MUST(begin_marks(board));
  SYMRIG_MUST(board.await_done(1s));
  const auto& events = board.session.events();
  SYMRIG_MUST(same("events", kMarks + 2, events.size()));
  SYMRIG_MUST(same("events by number", kMarks + 2, static_cast<std::uint16_t>(board.session.ack - first)));
  SYMRIG_MUST(same("first event", symrig_wire_Event_run_started_tag, events.front().which_body));
  SYMRIG_MUST(same("last event", symrig_wire_Event_run_done_tag, events.back().which_body));
  for (std::uint32_t k = 0; k < kMarks; ++k) {
    SYMRIG_MUST(same("event", symrig_wire_Event_step_mark_tag, events[k + 1].which_body));
    SYMRIG_MUST(same("ordinal", k, events[k + 1].body.step_mark.ordinal));
  }
  return {};
}

/// If the host does not acknowledge, the board repeats the events after 50 ms without progress.
Verdict sent_again(BoardUnderTest& board) {
  board.session.acknowledges = false;
  SYMRIG_MUST(begin_marks(board));
  board.session.listen_for(300ms);
  SYMRIG_MUST(same("different events", kMarks + 2, numbers(board).size()));
  SYMRIG_MUST(within("copies of each event", 2, 20, board.session.count(Kind::event) / (kMarks + 2)));
  board.session.acknowledges = true;
  SYMRIG_MUST(board.await_done(1s));
  board.session.listen_for(kQuietTime);
  board.session.forget();
  board.session.listen_for(150ms);
  return same("events after the acknowledgement", 0, board.session.count(Kind::event));
}

/// No more events in flight than the host's credit.
Verdict credit(BoardUnderTest& board) {
  board.session.credit = 2;
  board.session.acknowledges = false;
  SYMRIG_MUST(begin_marks(board));
  board.session.listen_for(200ms);
  SYMRIG_MUST(same("different events with credit 2", 2, numbers(board).size()));
  board.session.acknowledges = true;
  SYMRIG_MUST(board.await_done(2s));
  return same("events in the end", kMarks + 2, board.session.events().size());
}

/// After a NAK the board repeats at once, from the first event without an acknowledgement.
Verdict nak(BoardUnderTest& board) {
  board.session.acknowledges = false;
  const std::uint16_t first = board.session.ack;
  SYMRIG_MUST(begin_marks(board));
  board.session.listen_until([&] { return board.session.count(Kind::event) >= kMarks + 2; }, 1s);
  board.session.forget();
  board.session.send(Kind::nak, board.session.seq, 0, {});
  board.session.listen_for(30ms);  // less than the 50 ms after which the board repeats them anyway
  SYMRIG_MUST(within("events after NAK", 1, 100, board.session.count(Kind::event)));
  const auto& frames = board.session.frames();
  const auto again = std::find_if(frames.begin(), frames.end(),
                                  [](const Received& frame) { return frame.header.kind == Kind::event; });
  return same("number of the first event after NAK", first, again->header.seq);
}

/// More marks than the board can keep. It reports the number of lost marks at their place, and in run_done.
Verdict lost_are_counted(BoardUnderTest& board) {
  const std::uint32_t marks = board.can.event_ring + 40;
  board.session.credit = 0;
  SYMRIG_MUST(board.load(pack({loop(marks), mark(1), word(0, board.word()), end_loop(), end()})));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  board.session.forget();
  SYMRIG_MUST(code_is("start", symrig_wire_Code_CODE_OK, board.start()));
  board.session.listen_for(TickRate{board.can.tick_hz}.nanoseconds({std::uint64_t{marks} * board.word()}) +
                           20ms);
  board.session.credit = 64;
  board.session.send(Kind::ack, board.session.seq, 0, {});
  SYMRIG_MUST(board.await_done(5s));
  std::uint64_t arrived = 0;
  std::uint64_t reported = 0;
  for (const symrig_wire_Event& event : board.session.events()) {
    if (event.which_body == symrig_wire_Event_step_mark_tag) ++arrived;
    if (event.which_body == symrig_wire_Event_events_lost_tag) reported += event.body.events_lost.count;
  }
  SYMRIG_MUST(same("marks that arrived or are reported as lost", marks, arrived + reported));
  SYMRIG_MUST(within("marks reported as lost", 1, marks, reported));
  return same("events_lost of run_done", reported, board.done().events_lost);
}

constexpr std::array<Check, 5> kEventChecks{{
    {"events.in_order", "events come in order and without gaps", in_order},
    {"events.sent_again", "the board repeats events until the host acknowledges them", sent_again},
    {"events.credit", "no more events in flight than the host's credit", credit},
    {"events.nak", "after a NAK the board repeats events at once", nak},
    {"events.lost_are_counted", "the board counts events for which it has no room", lost_are_counted},
}};

}  // namespace

std::span<const Check> event_checks() {
  return kEventChecks;
}

}  // namespace symrig::conformance
