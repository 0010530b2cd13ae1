// SPDX-License-Identifier: Apache-2.0
// The board's identity and capabilities.
// The board keeps events until the host acknowledges them.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"
#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <set>
#include <string>

namespace symrig::conformance {
namespace {

using protocol::raw;

Verdict hello(BoardUnderTest& board) {
  SYMRIG_MUST(same("proto_major", protocol::kProtoMajor, board.who.proto_major));
  SYMRIG_MUST(that(board.who.board[0] != 0, "the board has a name"));
  SYMRIG_MUST(that(board.who.firmware_version[0] != 0, "the board has a firmware version"));
  SYMRIG_MUST(that(board.who.unique_id.size > 0, "the board has a unique id"));
  return same("required features", 0, board.who.required);
}

Verdict stable(BoardUnderTest& board) {
  const auto again = board.session.hello();
  if (!again) return failed("no answer to hello");
  const symrig_wire_HelloReply& now = again->body.hello;
  SYMRIG_MUST(same("firmware_hash", board.who.firmware_hash, now.firmware_hash));
  SYMRIG_MUST(same("schema_hash", board.who.schema_hash, now.schema_hash));
  SYMRIG_MUST(same("size of unique_id", board.who.unique_id.size, now.unique_id.size));
  return that(std::memcmp(board.who.unique_id.bytes, now.unique_id.bytes, now.unique_id.size) == 0,
              "the unique id is the same");
}

Verdict capabilities(BoardUnderTest& board) {
  const symrig_wire_CapabilitiesReply& can = board.can;
  SYMRIG_MUST(within("lines", 1, protocol::kMaxLines, can.lines));
  SYMRIG_MUST(within("min_dwell", 1, UINT32_MAX / 2, can.min_dwell));
  SYMRIG_MUST(within("max_dwell", 2 * std::uint64_t{can.min_dwell}, UINT32_MAX, can.max_dwell));
  SYMRIG_MUST(within("program_bytes", 8, UINT32_MAX, can.program_bytes));
  SYMRIG_MUST(same("program_bytes modulo 8", 0, can.program_bytes % 8));
  SYMRIG_MUST(within("loop_depth", 1, protocol::kMaxLoopDepth, can.loop_depth));
  SYMRIG_MUST(within("mtu", protocol::kLeastMtu, protocol::kMtu, can.mtu));
  SYMRIG_MUST(within("window", 1, 255, can.window));
  SYMRIG_MUST(within("event_ring", 8, 16'384, can.event_ring));
  return within("queue_segments", 2, UINT32_MAX, can.queue_segments);
}

Verdict lines(BoardUnderTest& board) {
  std::set<std::string> names;
  for (const symrig_wire_LineReply& line : board.lines) {
    SYMRIG_MUST(that(line.name[0] != 0 && names.insert(line.name).second, "each line has a name of its own"));
    if (raw(line.direction) == symrig_wire_Direction_DIRECTION_INPUT) continue;
    SYMRIG_MUST(within("number of an output", 0, protocol::kMaxOutputs - 1, line.line));
    SYMRIG_MUST(same("waits of an output", 0, line.waits));
  }
  return {};
}

Verdict no_such_line(BoardUnderTest& board) {
  symrig_wire_Request request = make_request(symrig_wire_Request_capabilities_line_tag);
  request.body.capabilities_line.line = board.can.lines;
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(
      code_is("capabilities_line", symrig_wire_Code_CODE_NO_SUCH_LINE, reply ? raw(reply->code) : kNoCode));
  return same("detail", board.can.lines, reply->detail);
}

Verdict config_hash(BoardUnderTest& board) {
  for (const symrig_wire_LineReply& line : board.lines) board.config_line(line.line);
  symrig_wire_Request request = make_request(symrig_wire_Request_finalize_config_tag);
  const std::uint32_t own = protocol::config_hash(board.config);
  request.body.finalize_config.hash = own + 1;
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(
      code_is("finalize_config", symrig_wire_Code_CODE_HASH_MISMATCH, reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same("the board's hash of its configuration", own, reply->detail));
  return board.in_state(symrig_wire_State_STATE_SAFE);
}

Verdict wrong_direction(BoardUnderTest& board) {
  const std::uint32_t line = board.outputs().front();
  board.config.lines[line].output = false;
  return code_is("an output as an input", symrig_wire_Code_CODE_WRONG_DIRECTION, board.config_line(line));
}

Verdict reboot_token(BoardUnderTest& board) {
  symrig_wire_Request request = make_request(symrig_wire_Request_reboot_tag);
  request.body.reboot.token = protocol::crc32c({board.who.unique_id.bytes, board.who.unique_id.size}) ^ 1U;
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(code_is("reboot with a wrong token", symrig_wire_Code_CODE_BAD_VALUE,
                      reply ? raw(reply->code) : kNoCode));
  board.session.listen_for(kQuietTime);
  return board.in_state(symrig_wire_State_STATE_SAFE);
}

Verdict identify(BoardUnderTest& board) {
  symrig_wire_Request request = make_request(symrig_wire_Request_identify_tag);
  request.body.identify.seconds = 61;
  SYMRIG_MUST(code_is("identify for 61 s", symrig_wire_Code_CODE_BAD_VALUE, board.session.code(request)));
  request.body.identify.seconds = 0;
  return code_is("identify for 0 s", symrig_wire_Code_CODE_OK, board.session.code(request));
}

constexpr std::array<Check, 9> kIdentityChecks{{
    {"identity.hello", "reports its identity, and requires no unknown feature", hello},
    {"identity.stable", "reports the same identity again", stable},
    {"identity.capabilities", "its numbers are consistent", capabilities},
    {"identity.lines", "lines have names; outputs are among the first 28", lines},
    {"identity.no_such_line", "refuses a line that does not exist", no_such_line},
    {"identity.config_hash", "computes the same hash of its configuration as the host", config_hash},
    {"identity.wrong_direction", "refuses an output as an input", wrong_direction},
    {"identity.reboot_token", "does not restart without the right token", reboot_token},
    {"identity.identify", "blinks for at most 60 s", identify},
}};

}  // namespace

std::span<const Check> identity_checks() {
  return kIdentityChecks;
}

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
