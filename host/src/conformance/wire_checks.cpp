// SPDX-License-Identifier: Apache-2.0
// Frames that are lost, repeated, out of order, cut or damaged; and what is answered to sound frames that say
// nothing sensible.
#include "conformance/plan.hpp"
#include "conformance/subject.hpp"

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

/// Bytes that must not be answered, and then whether the session goes on as if nothing had been.
Verdict ignored(Subject& board, const Bytes& bytes, std::uint32_t bad_frames) {
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

Verdict zeros(Subject& board) {
  return ignored(board, Bytes(100, 0), 0);
}

/// One bit flipped in each byte of a frame in turn. A flip that makes a zero cuts the frame in two.
Verdict corrupted(Subject& board) {
  const Bytes sound = board.session.frame(Kind::request, board.session.seq, 0, time_ping(12345));
  for (std::size_t k = 0; k + 1 < sound.size(); ++k) {
    Bytes damaged = sound;
    damaged[k] = static_cast<std::uint8_t>(damaged[k] ^ (damaged[k] == 0x40 ? 0x80U : 0x40U));
    board.session.forget();
    board.session.send_bytes(damaged);
  }
  board.session.listen_for(kQuietTime);
  SYMRIG_MUST(same("frames in answer", 0, board.session.frames().size()));
  return that(board.time().has_value(), "an answer to the next sound frame");
}

Verdict truncated(Subject& board) {
  Bytes cut = board.session.frame(Kind::request, board.session.seq, 0, time_ping());
  cut.resize(cut.size() / 2);
  cut.push_back(0);
  return ignored(board, cut, 1);
}

Verdict endless_frame(Subject& board) {
  Bytes endless(2000, 1);
  endless.push_back(0);
  return ignored(board, endless, 1);
}

Verdict bad_kind(Subject& board) {
  return ignored(board, board.session.frame(static_cast<Kind>(9), board.session.seq, 0, time_ping()), 1);
}

/// The answer is kept: the same bytes, the same moment.
Verdict duplicated(Subject& board) {
  const std::uint16_t number = board.session.seq;
  if (!board.session.ask_bytes(time_ping(77))) return failed("no answer to time_ping");
  const Received first = *board.session.last(Kind::reply);
  board.session.forget();
  board.session.send(Kind::request, number, 0, time_ping(77));
  board.session.listen_until([&] { return board.session.count(Kind::reply) > 0; }, kAnswerTime);
  const Received* again = board.session.last(Kind::reply);
  if (again == nullptr) return failed("a repeated request is not answered");
  SYMRIG_MUST(same("ack of the repeated answer", first.header.ack, again->header.ack));
  return that(again->body == first.body, "the very same answer to a repeated request");
}

/// A start that comes twice starts once.
Verdict done_once(Subject& board) {
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

/// Answers to a numbered frame with that number, which is not used up.
const Received* answer_to(Subject& board, std::uint16_t number, const Bytes& body, Kind wanted) {
  board.session.forget();
  board.session.send(Kind::request, number, 0, body);
  board.session.listen_until([&] { return board.session.count(wanted) > 0; }, kAnswerTime);
  return board.session.last(wanted);
}

Verdict lost(Subject& board) {
  const std::uint16_t expected = board.session.seq;
  const Bytes reset = RawSession::bytes_of(make_request(symrig_wire_Request_reset_config_tag));
  const Received* nak = answer_to(board, static_cast<std::uint16_t>(expected + 1), reset, Kind::nak);
  if (nak == nullptr) return failed("a frame after a gap: expected NAK, got none");
  SYMRIG_MUST(same("ack of the NAK", expected, nak->header.ack));
  SYMRIG_MUST(same("replies to a frame after a gap", 0, board.session.count(Kind::reply)));
  return that(board.time().has_value(), "an answer to the frame that was missing");
}

Verdict old(Subject& board) {
  SYMRIG_MUST(that(board.time() && board.time() && board.time(), "answers to three time_pings"));
  const auto number = static_cast<std::uint16_t>(board.session.seq - 3);
  const Received* ack = answer_to(board, number, time_ping(), Kind::ack);
  if (ack == nullptr) return failed("a frame of long ago: expected ACK, got none");
  SYMRIG_MUST(same("ack of the ACK", board.session.seq, ack->header.ack));
  return same("replies to a frame of long ago", 0, board.session.count(Kind::reply));
}

Verdict hello_anywhere(Subject& board) {
  const Bytes half = board.session.frame(Kind::request, board.session.seq, 0, time_ping());
  board.session.send_bytes(std::span(half).first(half.size() / 2));
  board.session.seq = static_cast<std::uint16_t>(board.session.seq + 0x1234);
  SYMRIG_MUST(that(board.session.hello().has_value(), "an answer to hello amid rubbish"));
  return that(board.time().has_value(), "the session goes on from the number of hello");
}

Verdict sequence_wraps(Subject& board) {
  board.session.seq = 0xFFFD;
  SYMRIG_MUST(that(board.session.hello().has_value(), "an answer to hello"));
  for (int k = 0; k < 6; ++k) SYMRIG_MUST(that(board.time().has_value(), "answers across number 65535"));
  return {};
}

Verdict unknown_request(Subject& board) {
  const auto reply = board.session.ask_bytes({0xFA, 0x03, 0x00});  // field 63, empty
  return code_is("request 63", symrig_wire_Code_CODE_UNKNOWN_REQUEST, reply ? raw(reply->code) : kNoCode);
}

Verdict unknown_field(Subject& board) {
  Bytes body = time_ping(5);
  body.insert(body.end(), {0xF8, 0x3F, 0x01});  // field 1023 = 1
  const auto reply = board.session.ask_bytes(body);
  return code_is("a request with a field to come", symrig_wire_Code_CODE_OK,
                 reply ? raw(reply->code) : kNoCode);
}

Verdict bad_body(Subject& board) {
  for (const Bytes& body : {Bytes{0xFF}, Bytes{0x0A, 0x7F}, Bytes(40, 0xFF), Bytes{0x1A, 0x03, 0x08, 0x80}}) {
    const auto reply = board.session.ask_bytes(body);
    SYMRIG_MUST(code_is("a body that is no message", symrig_wire_Code_CODE_DECODE,
                        reply ? raw(reply->code) : kNoCode));
  }
  return board.in_state(symrig_wire_State_STATE_SAFE);
}

Verdict bad_chunk_body(Subject& board) {
  SYMRIG_MUST(board.configure());
  board.session.forget();
  board.session.send(Kind::data, board.session.seq++, 0, Bytes(9, 1));
  board.session.listen_until([&] { return board.session.count(Kind::reply) > 0; }, kAnswerTime);
  const Received* answer = board.session.last(Kind::reply);
  if (answer == nullptr) return failed("a chunk that is none is not answered");
  symrig_wire_Reply reply;
  SYMRIG_MUST(that(protocol::decode({answer->body.data(), answer->body.size()}, reply), "a reply"));
  return code_is("a chunk that is none", symrig_wire_Code_CODE_DECODE, raw(reply.code));
}

Verdict version(Subject& board) {
  const auto reply = board.session.ask_bytes(time_ping(), protocol::kProtoMajor + 1);
  return code_is("a request of the next major version", symrig_wire_Code_CODE_VERSION,
                 reply ? raw(reply->code) : kNoCode);
}

/// Out of turn: no numbers move.
Verdict urgent(Subject& board, pb_size_t which, std::uint32_t expected) {
  const std::uint16_t before = board.session.seq;
  const auto reply = board.session.ask_urgently(make_request(which));
  SYMRIG_MUST(code_is("urgent", expected, reply ? raw(reply->code) : kNoCode));
  board.session.seq = before;
  return that(board.time().has_value(), "the session goes on with the number that it had");
}
Verdict urgent_abort(Subject& board) {
  return urgent(board, symrig_wire_Request_abort_tag, symrig_wire_Code_CODE_OK);
}
Verdict urgent_time(Subject& board) {
  return urgent(board, symrig_wire_Request_time_ping_tag, symrig_wire_Code_CODE_OK);
}
Verdict urgent_other(Subject& board) {
  return urgent(board, symrig_wire_Request_reset_config_tag, symrig_wire_Code_CODE_NOT_URGENT);
}

constexpr std::array<Check, 19> kWireChecks{{
    {"wire.zeros", "zeros between frames mean nothing", zeros},
    {"wire.corrupted", "a flipped bit anywhere: no answer, no harm", corrupted},
    {"wire.truncated", "half a frame: no answer, counted", truncated},
    {"wire.too_long", "2,000 bytes without a zero: no answer, counted", endless_frame},
    {"wire.bad_kind", "a kind of frame that is none: no answer, counted", bad_kind},
    {"wire.duplicated", "a repeated request is answered from memory", duplicated},
    {"wire.done_once", "a start that comes three times starts once", done_once},
    {"wire.lost", "a frame after a gap is not carried out; NAK tells what is missing", lost},
    {"wire.old", "a frame of long ago is acknowledged and not carried out", old},
    {"wire.hello_anywhere", "a session can begin amid rubbish, with any number", hello_anywhere},
    {"wire.sequence_wraps", "numbers go on from 65535 to 0", sequence_wraps},
    {"wire.unknown_request", "a request to come is refused by its code", unknown_request},
    {"wire.unknown_field", "a field to come is passed over", unknown_field},
    {"wire.bad_body", "a body that is no message is answered, and no fault", bad_body},
    {"wire.bad_chunk_body", "a chunk that is none is answered", bad_chunk_body},
    {"wire.version", "another major version is refused by its code", version},
    {"wire.urgent_abort", "abort out of turn", urgent_abort},
    {"wire.urgent_time", "time_ping out of turn", urgent_time},
    {"wire.urgent_other", "nothing else out of turn", urgent_other},
}};

}  // namespace

std::span<const Check> wire_checks() {
  return kWireChecks;
}

}  // namespace symrig::conformance
