// SPDX-License-Identifier: Apache-2.0
// The board's identity and capabilities.
#include "conformance/board_under_test.hpp"
#include "symrig/protocol/data_chunk.hpp"

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

}  // namespace symrig::conformance
