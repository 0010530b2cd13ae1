// SPDX-License-Identifier: Apache-2.0
// Uploads: chunks in a window, lost, repeated, out of order; and refused commits.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"
#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace symrig::conformance {
namespace {

using protocol::Kind;
using protocol::raw;

/// A legal program of this length. All words differ, so that a chunk in the wrong place changes the CRC.
Bytes program_of(const BoardUnderTest& board, std::size_t bytes) {
  Bytes program;
  const std::size_t records = std::min<std::size_t>(bytes, board.can.program_bytes) / protocol::kRecordSize;
  for (std::size_t k = 0; k + 1 < records; ++k) {
    const Bytes one = pack({word(0, board.word() + static_cast<std::uint32_t>(k % 1000))});
    program.insert(program.end(), one.begin(), one.end());
  }
  const Bytes last = pack({end()});
  program.insert(program.end(), last.begin(), last.end());
  return program;
}

/// Bytes of the longest chunk that the board receives.
std::size_t chunk_room(const BoardUnderTest& board) {
  return protocol::chunk_room(board.can.mtu);
}

struct Upload {
  BoardUnderTest& board;
  Bytes program;
  std::uint16_t first = 0;  ///< number of the first chunk

  std::size_t room() const { return chunk_room(board); }
  std::size_t chunks() const { return (program.size() + room() - 1) / room(); }
  std::span<const std::uint8_t> chunk(std::size_t k) const {
    return std::span(program).subspan(k * room(), std::min(room(), program.size() - k * room()));
  }
  Verdict begin() {
    SYMRIG_MUST(board.configure());
    SYMRIG_MUST(code_is("program_begin", symrig_wire_Code_CODE_OK,
                        board.program_begin(static_cast<std::uint32_t>(program.size()))));
    first = board.session.seq;
    board.session.forget();
    return {};
  }
  /// Sends chunk k under its own number, in any order.
  void send(std::size_t k) {
    board.session.send(
        Kind::data, static_cast<std::uint16_t>(first + k), 0,
        RawSession::chunk_body(board.program_id, static_cast<std::uint32_t>(k * room()), chunk(k)));
  }
  bool acknowledged(std::size_t k) {
    const auto wanted = static_cast<std::uint16_t>(first + k + 1);
    const auto seen = [&] {
      const auto& frames = board.session.frames();
      return std::any_of(frames.begin(), frames.end(), [&](const Received& frame) {
        return frame.header.kind == Kind::ack && frame.header.ack == wanted;
      });
    };
    return board.session.listen_until(seen, kAnswerTime);
  }
  Verdict commit() {
    board.session.seq = static_cast<std::uint16_t>(first + chunks());
    const std::uint32_t crc = protocol::crc32c({program.data(), program.size()});
    SYMRIG_MUST(code_is("program_commit", symrig_wire_Code_CODE_OK, board.commit(crc)));
    const auto now = board.status();
    return now ? same("program_hash", crc, now->program_hash) : failed("no answer to get_status");
  }
};

Verdict window(BoardUnderTest& board) {
  Upload upload{board, program_of(board, chunk_room(board) * board.can.window)};
  SYMRIG_MUST(upload.begin());
  for (std::size_t k = 0; k < upload.chunks(); ++k) upload.send(k);
  SYMRIG_MUST(
      that(upload.acknowledged(upload.chunks() - 1), "the board acknowledges a whole window of chunks"));
  SYMRIG_MUST(same("NAKs", 0, board.session.count(Kind::nak)));
  return upload.commit();
}

Verdict chunk_repeated(BoardUnderTest& board) {
  Upload upload{board, program_of(board, 2 * chunk_room(board))};
  SYMRIG_MUST(upload.begin());
  upload.send(0);
  upload.send(0);
  upload.send(1);
  upload.send(1);
  SYMRIG_MUST(that(upload.acknowledged(upload.chunks() - 1), "the board acknowledges repeated chunks"));
  SYMRIG_MUST(same("refusals", 0, board.session.count(Kind::reply)));
  return upload.commit();
}

Verdict chunks_out_of_order(BoardUnderTest& board) {
  Upload upload{board, program_of(board, 3 * chunk_room(board))};
  if (upload.chunks() < 3) return skipped("the board has no room for three chunks");
  SYMRIG_MUST(upload.begin());
  upload.send(1);
  board.session.listen_until([&] { return board.session.count(Kind::nak) > 0; }, kAnswerTime);
  const Received* nak = board.session.last(Kind::nak);
  if (nak == nullptr) return failed("a chunk after a gap: expected NAK, got none");
  SYMRIG_MUST(same("ack of the NAK", upload.first, nak->header.ack));
  for (std::size_t k = 0; k < 3; ++k) upload.send(k);
  SYMRIG_MUST(that(upload.acknowledged(2), "the board acknowledges chunks in order"));
  return upload.commit();
}

/// A chunk with the right frame number, but the wrong offset in the program.
Verdict chunk_misplaced(BoardUnderTest& board) {
  Upload upload{board, program_of(board, 2 * chunk_room(board))};
  SYMRIG_MUST(upload.begin());
  board.session.send_chunk(board.program_id, 8, upload.chunk(0));
  board.session.listen_until([&] { return board.session.count(Kind::reply) > 0; }, kAnswerTime);
  const Received* answer = board.session.last(Kind::reply);
  if (answer == nullptr) return failed("a misplaced chunk: expected a refusal, got no answer");
  symrig_wire_Reply reply;
  SYMRIG_MUST(that(protocol::decode({answer->body.data(), answer->body.size()}, reply), "a reply"));
  SYMRIG_MUST(code_is("a misplaced chunk", symrig_wire_Code_CODE_BAD_CHUNK, raw(reply.code)));
  SYMRIG_MUST(same("detail, the expected offset", 0, reply.detail));
  const std::uint32_t crc = protocol::crc32c({upload.program.data(), upload.program.size()});
  return code_is("program_commit after it", symrig_wire_Code_CODE_INCOMPLETE, board.commit(crc));
}

Verdict incomplete(BoardUnderTest& board) {
  Upload upload{board, program_of(board, 2 * chunk_room(board))};
  SYMRIG_MUST(upload.begin());
  upload.send(0);
  SYMRIG_MUST(that(upload.acknowledged(0), "the board acknowledges a chunk"));
  board.session.seq = static_cast<std::uint16_t>(upload.first + 1);
  symrig_wire_Request request = make_request(symrig_wire_Request_program_commit_tag);
  request.body.program_commit = {board.program_id, 0};
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(code_is("program_commit of half a program", symrig_wire_Code_CODE_INCOMPLETE,
                      reply ? raw(reply->code) : kNoCode));
  return same("detail, the received bytes", chunk_room(board), reply->detail);
}

Verdict wrong_crc(BoardUnderTest& board) {
  const Bytes program = program_of(board, 64);
  SYMRIG_MUST(board.configure());
  SYMRIG_MUST(board.send_program(program));
  const std::uint32_t crc = protocol::crc32c({program.data(), program.size()});
  symrig_wire_Request request = make_request(symrig_wire_Request_program_commit_tag);
  request.body.program_commit = {board.program_id, crc ^ 1U};
  const auto reply = board.session.ask(request);
  SYMRIG_MUST(code_is("program_commit with a wrong CRC", symrig_wire_Code_CODE_HASH_MISMATCH,
                      reply ? raw(reply->code) : kNoCode));
  SYMRIG_MUST(same("detail, the CRC of the received bytes", crc, reply->detail));
  return board.in_state(symrig_wire_State_STATE_CONFIGURED);
}

/// A program that fills the board's program memory.
Verdict full(BoardUnderTest& board) {
  SYMRIG_MUST(board.configure());
  SYMRIG_MUST(board.upload(program_of(board, board.can.program_bytes)));
  SYMRIG_MUST(same("steps", board.can.program_bytes / protocol::kRecordSize - 1, board.committed.steps));
  return code_is("program_verify", symrig_wire_Code_CODE_OK,
                 board.code(symrig_wire_Request_program_verify_tag));
}

/// A new configuration drops the program.
Verdict dropped_with_config(BoardUnderTest& board) {
  SYMRIG_MUST(board.load(program_of(board, 64)));
  SYMRIG_MUST(code_is("config_line", symrig_wire_Code_CODE_OK, board.config_line(board.outputs().front())));
  const auto now = board.status();
  if (!now) return failed("no answer to get_status");
  SYMRIG_MUST(same("state", symrig_wire_State_STATE_SAFE, raw(now->state)));
  return same("program_hash", 0, now->program_hash);
}

constexpr std::array<Check, 8> kUploadChecks{{
    {"upload.window", "accepts a whole window of chunks at once", window},
    {"upload.chunk_repeated", "accepts a repeated chunk only once", chunk_repeated},
    {"upload.chunks_out_of_order", "does not accept a chunk after a gap", chunks_out_of_order},
    {"upload.chunk_misplaced", "refuses a chunk that leaves a gap in the program", chunk_misplaced},
    {"upload.incomplete", "does not commit half a program", incomplete},
    {"upload.wrong_crc", "does not commit a program with another CRC", wrong_crc},
    {"upload.full", "accepts a program that fills its memory", full},
    {"upload.dropped_with_config", "a new configuration drops the program", dropped_with_config},
}};

}  // namespace

std::span<const Check> upload_checks() {
  return kUploadChecks;
}

}  // namespace symrig::conformance
