// SPDX-License-Identifier: Apache-2.0
// Frames that are lost, repeated, out of order, cut or damaged, and undamaged frames with invalid content.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace symrig::conformance {
namespace {

using protocol::Kind;
using protocol::raw;

Bytes time_ping(std::uint64_t host_ns = 0) {
  symrig_wire_Request request = make_request(symrig_wire_Request_time_ping_tag);
  request.body.time_ping.host_ns = host_ns;
  return RawSession::bytes_of(request);
}

/// Sends bytes that the board must not answer. Then checks that the session continues.
Verdict ignored(BoardUnderTest& board, const Bytes& bytes, std::uint32_t bad_frames) {
  const auto before = board.status();
  if (!before) return failed("no answer to get_status");
  board.session.forget();
  board.session.send_bytes(bytes);
  board.session.listen_for(kQuietTime);
  SYMRIG_MUST(same("frames in answer", 0, board.session.frames().size()));
  const auto after = board.status();
  if (!after) return failed("no answer to the next request");
  return same("bad_frames counted", bad_frames, after->bad_frames - before->bad_frames);
}

Verdict zeros(BoardUnderTest& board) {
  return ignored(board, Bytes(100, 0), 0);
}

/// Flips one bit in each byte of a frame, one after the other. If the flip makes a zero, it cuts the frame in
/// two.
Verdict corrupted(BoardUnderTest& board) {
  const Bytes sound = board.session.frame(Kind::request, board.session.seq, 0, time_ping(12345));
  for (std::size_t k = 0; k + 1 < sound.size(); ++k) {
    Bytes damaged = sound;
    damaged[k] = static_cast<std::uint8_t>(damaged[k] ^ (damaged[k] == 0x40 ? 0x80U : 0x40U));
    board.session.forget();
    board.session.send_bytes(damaged);
  }
  board.session.listen_for(kQuietTime);
  SYMRIG_MUST(same("frames in answer", 0, board.session.frames().size()));
  return that(board.time().has_value(), "the board answers the next undamaged frame");
}

Verdict truncated(BoardUnderTest& board) {
  Bytes cut = board.session.frame(Kind::request, board.session.seq, 0, time_ping());
  cut.resize(cut.size() / 2);
  cut.push_back(0);
  return ignored(board, cut, 1);
}

Verdict endless_frame(BoardUnderTest& board) {
  Bytes endless(2000, 1);
  endless.push_back(0);
  return ignored(board, endless, 1);
}

Verdict bad_kind(BoardUnderTest& board) {
  return ignored(board, board.session.frame(static_cast<Kind>(9), board.session.seq, 0, time_ping()), 1);
}

/// The board keeps the answer: the second one has the same bytes, and so the same tick.
Verdict duplicated(BoardUnderTest& board) {
  const std::uint16_t number = board.session.seq;
  if (!board.session.ask_bytes(time_ping(77))) return failed("no answer to time_ping");
  const Received first = *board.session.last(Kind::reply);
  board.session.forget();
  board.session.send(Kind::request, number, 0, time_ping(77));
  board.session.listen_until([&] { return board.session.count(Kind::reply) > 0; }, kAnswerTime);
  const Received* again = board.session.last(Kind::reply);
  if (again == nullptr) return failed("a repeated request is not answered");
  SYMRIG_MUST(same("ack of the repeated answer", first.header.ack, again->header.ack));
  return that(again->body == first.body, "the answer to a repeated request has the same bytes");
}

/// A repeated start request starts only once.
Verdict done_once(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(pack({mark(1), word(1U << board.outputs().front(), board.word()), end()})));
  SYMRIG_MUST(code_is("arm", symrig_wire_Code_CODE_OK, board.arm()));
  board.session.forget();
  const Bytes start = RawSession::bytes_of(make_request(symrig_wire_Request_start_tag));
  const std::uint16_t number = board.session.seq++;
  board.session.send(Kind::request, number, 0, start);
  board.session.send(Kind::request, number, 0, start);
  SYMRIG_MUST(board.await_done(Nanoseconds(1'000'000'000)));
  board.session.send(Kind::request, number, 0, start);
  board.session.listen_for(kQuietTime);
  const auto& events = board.session.events();
  const auto runs = std::count_if(events.begin(), events.end(), [](const symrig_wire_Event& event) {
    return event.which_body == symrig_wire_Event_run_started_tag;
  });
  return same("runs", 1, static_cast<std::uint64_t>(runs));
}

/// Sends a frame with this number, without a change of the session's own number. Returns the answer.
const Received* answer_to(BoardUnderTest& board, std::uint16_t number, const Bytes& body, Kind wanted) {
  board.session.forget();
  board.session.send(Kind::request, number, 0, body);
  board.session.listen_until([&] { return board.session.count(wanted) > 0; }, kAnswerTime);
  return board.session.last(wanted);
}

Verdict lost(BoardUnderTest& board) {
  const std::uint16_t expected = board.session.seq;
  const Bytes reset = RawSession::bytes_of(make_request(symrig_wire_Request_reset_config_tag));
  const Received* nak = answer_to(board, static_cast<std::uint16_t>(expected + 1), reset, Kind::nak);
  if (nak == nullptr) return failed("a frame after a gap: expected NAK, got none");
  SYMRIG_MUST(same("ack of the NAK", expected, nak->header.ack));
  SYMRIG_MUST(same("replies to a frame after a gap", 0, board.session.count(Kind::reply)));
  return that(board.time().has_value(), "the board answers the missing frame");
}

Verdict old(BoardUnderTest& board) {
  SYMRIG_MUST(that(board.time() && board.time() && board.time(), "the board answers three time_pings"));
  const auto number = static_cast<std::uint16_t>(board.session.seq - 3);
  const Received* ack = answer_to(board, number, time_ping(), Kind::ack);
  if (ack == nullptr) return failed("an old frame: expected ACK, got none");
  SYMRIG_MUST(same("ack of the ACK", board.session.seq, ack->header.ack));
  return same("replies to an old frame", 0, board.session.count(Kind::reply));
}

Verdict hello_anywhere(BoardUnderTest& board) {
  const Bytes half = board.session.frame(Kind::request, board.session.seq, 0, time_ping());
  board.session.send_bytes(std::span(half).first(half.size() / 2));
  board.session.seq = static_cast<std::uint16_t>(board.session.seq + 0x1234);
  SYMRIG_MUST(that(board.session.hello().has_value(), "the board answers hello after half a frame"));
  return that(board.time().has_value(), "the session continues from the number of hello");
}

Verdict sequence_wraps(BoardUnderTest& board) {
  board.session.seq = 0xFFFD;
  SYMRIG_MUST(that(board.session.hello().has_value(), "the board answers hello"));
  for (int k = 0; k < 6; ++k)
    SYMRIG_MUST(that(board.time().has_value(), "the board answers across number 65535"));
  return {};
}

Verdict unknown_request(BoardUnderTest& board) {
  const auto reply = board.session.ask_bytes({0xFA, 0x03, 0x00});  // field 63, empty
  return code_is("request 63", symrig_wire_Code_CODE_UNKNOWN_REQUEST, reply ? raw(reply->code) : kNoCode);
}

Verdict unknown_field(BoardUnderTest& board) {
  Bytes body = time_ping(5);
  body.insert(body.end(), {0xF8, 0x3F, 0x01});  // field 1023 = 1
  const auto reply = board.session.ask_bytes(body);
  return code_is("a request with an unknown field", symrig_wire_Code_CODE_OK,
                 reply ? raw(reply->code) : kNoCode);
}

Verdict bad_body(BoardUnderTest& board) {
  for (const Bytes& body : {Bytes{0xFF}, Bytes{0x0A, 0x7F}, Bytes(40, 0xFF), Bytes{0x1A, 0x03, 0x08, 0x80}}) {
    const auto reply = board.session.ask_bytes(body);
    SYMRIG_MUST(code_is("a body that is not a message", symrig_wire_Code_CODE_DECODE,
                        reply ? raw(reply->code) : kNoCode));
  }
  return board.in_state(symrig_wire_State_STATE_SAFE);
}

Verdict bad_chunk_body(BoardUnderTest& board) {
  SYMRIG_MUST(board.configure());
  board.session.forget();
  board.session.send(Kind::data, board.session.seq++, 0, Bytes(9, 1));
  board.session.listen_until([&] { return board.session.count(Kind::reply) > 0; }, kAnswerTime);
  const Received* answer = board.session.last(Kind::reply);
  if (answer == nullptr) return failed("the board does not answer an invalid chunk");
  symrig_wire_Reply reply;
  SYMRIG_MUST(that(protocol::decode({answer->body.data(), answer->body.size()}, reply), "a reply"));
  return code_is("an invalid chunk", symrig_wire_Code_CODE_DECODE, raw(reply.code));
}

Verdict version(BoardUnderTest& board) {
  const auto reply = board.session.ask_bytes(time_ping(), protocol::kProtoMajor + 1);
  return code_is("a request of the next major version", symrig_wire_Code_CODE_VERSION,
                 reply ? raw(reply->code) : kNoCode);
}

/// Urgent requests do not change the numbers of the session.
Verdict urgent(BoardUnderTest& board, pb_size_t which, std::uint32_t expected) {
  const std::uint16_t before = board.session.seq;
  const auto reply = board.session.ask_urgently(make_request(which));
  SYMRIG_MUST(code_is("urgent", expected, reply ? raw(reply->code) : kNoCode));
  board.session.seq = before;
  return that(board.time().has_value(), "the session continues with its number");
}
Verdict urgent_abort(BoardUnderTest& board) {
  return urgent(board, symrig_wire_Request_abort_tag, symrig_wire_Code_CODE_OK);
}
Verdict urgent_time(BoardUnderTest& board) {
  return urgent(board, symrig_wire_Request_time_ping_tag, symrig_wire_Code_CODE_OK);
}
Verdict urgent_other(BoardUnderTest& board) {
  return urgent(board, symrig_wire_Request_reset_config_tag, symrig_wire_Code_CODE_NOT_URGENT);
}

constexpr std::array<Check, 19> kWireChecks{{
    {"wire.zeros", "ignores zeros between frames", zeros},
    {"wire.corrupted", "a flipped bit anywhere: no answer, and the session continues", corrupted},
    {"wire.truncated", "half a frame: no answer, counted as bad", truncated},
    {"wire.too_long", "2,000 bytes without a zero: no answer, counted as bad", endless_frame},
    {"wire.bad_kind", "an unknown kind of frame: no answer, counted as bad", bad_kind},
    {"wire.duplicated", "answers a repeated request from memory", duplicated},
    {"wire.done_once", "a start that arrives three times starts once", done_once},
    {"wire.lost", "does not execute a frame after a gap; its NAK names the missing frame", lost},
    {"wire.old", "acknowledges an old frame and does not execute it", old},
    {"wire.hello_anywhere", "a session can begin after half a frame, with any number", hello_anywhere},
    {"wire.sequence_wraps", "numbers continue from 65535 to 0", sequence_wraps},
    {"wire.unknown_request", "refuses an unknown request by its code", unknown_request},
    {"wire.unknown_field", "ignores an unknown field", unknown_field},
    {"wire.bad_body", "answers a body that is not a message, without a fault", bad_body},
    {"wire.bad_chunk_body", "answers an invalid chunk", bad_chunk_body},
    {"wire.version", "refuses another major version by its code", version},
    {"wire.urgent_abort", "accepts an urgent abort", urgent_abort},
    {"wire.urgent_time", "accepts an urgent time_ping", urgent_time},
    {"wire.urgent_other", "refuses other urgent requests", urgent_other},
}};

}  // namespace

std::span<const Check> wire_checks() {
  return kWireChecks;
}

}  // namespace symrig::conformance
