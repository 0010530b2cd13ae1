// SPDX-License-Identifier: Apache-2.0
// Requests in each state: what is refused, with which code and field.
#include "raw_host.hpp"
#include "symrig/protocol/program.hpp"
#include "symrig/protocol/schema_hash.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::core_test {
namespace {

using protocol::LineConfig;
using protocol::Op;
using test::RawHost;

struct Bench {
  board_sim::SimBoard board;
  RawHost host{board};
  Bench() { host.hello(); }
};

std::vector<std::uint8_t> short_program() {
  std::vector<std::uint8_t> bytes;
  test::pack(protocol::make_record(Op::set_word, 1, 1000), bytes);
  test::pack(protocol::make_record(Op::end, 0, 0), bytes);
  return bytes;
}

TEST(Core, hello_tells_who_the_board_is) {
  board_sim::SimBoard board;
  RawHost host(board);
  const auto reply = host.hello();
  ASSERT_TRUE(reply.has_value());
  ASSERT_EQ(reply->which_body, symrig_wire_Reply_hello_tag);
  const symrig_wire_HelloReply& hello = reply->body.hello;
  EXPECT_EQ(hello.proto_major, 1U);
  EXPECT_EQ(hello.schema_hash, protocol::kSchemaHash);
  EXPECT_NE(hello.firmware_hash, 0U);
  EXPECT_EQ(std::string(hello.board), "sim");
  EXPECT_EQ(hello.unique_id.size, 8U);
  EXPECT_EQ(hello.required, 0U);
  EXPECT_EQ(hello.reset_fault, 0U);
}

TEST(Core, capabilities_tell_what_it_can_do) {
  Bench bench;
  const auto reply = bench.host.ask(RawHost::make(symrig_wire_Request_capabilities_tag));
  ASSERT_TRUE(reply && reply->which_body == symrig_wire_Reply_capabilities_tag);
  EXPECT_EQ(reply->body.capabilities.tick_hz, 125'000'000U);
  EXPECT_EQ(reply->body.capabilities.lines, 6U);
  EXPECT_EQ(reply->body.capabilities.loop_depth, 4U);
  EXPECT_EQ(reply->body.capabilities.mtu, 512U);
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_capabilities_line_tag);
  request.body.capabilities_line.line = 3;
  const auto line = bench.host.ask(request);
  ASSERT_TRUE(line && line->which_body == symrig_wire_Reply_line_tag);
  EXPECT_EQ(std::string(line->body.line.name), "vsync");
  EXPECT_EQ(line->body.line.direction, symrig_wire_Direction_DIRECTION_INPUT);
  request.body.capabilities_line.line = 6;
  EXPECT_EQ(bench.host.code(request), symrig_wire_Code_CODE_NO_SUCH_LINE);
}

TEST(Core, each_state_is_reached_in_turn) {
  Bench bench;
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_SAFE);
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_CONFIGURED);
  ASSERT_EQ(bench.host.upload(short_program()), 0U);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_LOADED);
  ASSERT_EQ(bench.host.arm(), 0U);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_ARMED);
  ASSERT_EQ(bench.host.start(), 0U);
  const symrig_wire_StatusReply running = bench.host.status();
  EXPECT_EQ(running.state, symrig_wire_State_STATE_RUNNING);
  EXPECT_EQ(running.levels & 7U, 1U);
  EXPECT_EQ(running.config_hash, bench.host.config_hash);
  EXPECT_EQ(running.program_hash, bench.host.program_hash);
  ASSERT_TRUE(bench.host.run_out(100'000));
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_DONE);
  ASSERT_EQ(bench.host.arm(), 0U);  // the same program once more
  ASSERT_EQ(bench.host.start(), 0U);
}

TEST(Core, a_program_may_start_again_and_again_with_the_same_result) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  ASSERT_EQ(bench.host.upload(short_program()), 0U);
  for (int k = 0; k < 5; ++k) {
    bench.host.events.clear();
    ASSERT_EQ(bench.host.arm(), 0U);
    ASSERT_EQ(bench.host.start(), 0U);
    ASSERT_TRUE(bench.host.run_out(100'000));
    EXPECT_EQ(bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done.duration, 1000U);
    EXPECT_EQ(bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done.steps, 1U);
  }
}

TEST(Core, what_is_out_of_turn_is_refused_with_the_state) {
  Bench bench;
  const auto refused = [&](const symrig_wire_Request& request) {
    const auto reply = bench.host.ask(request);
    return reply && reply->code == symrig_wire_Code_CODE_BAD_STATE &&
           reply->detail == static_cast<std::uint64_t>(symrig_wire_State_STATE_SAFE);
  };
  EXPECT_TRUE(refused(RawHost::make(symrig_wire_Request_arm_tag)));
  EXPECT_TRUE(refused(RawHost::make(symrig_wire_Request_start_tag)));
  EXPECT_TRUE(refused(RawHost::make(symrig_wire_Request_clear_fault_tag)));
  EXPECT_TRUE(refused(RawHost::make(symrig_wire_Request_program_commit_tag)));
  symrig_wire_Request begin = RawHost::make(symrig_wire_Request_program_begin_tag);
  begin.body.program_begin = {1, 16};
  EXPECT_TRUE(refused(begin));
}

TEST(Core, nothing_changes_under_a_running_program) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  ASSERT_EQ(bench.host.upload(short_program()), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  EXPECT_EQ(bench.host.reset_config(), symrig_wire_Code_CODE_BAD_STATE);
  EXPECT_EQ(bench.host.config_line(0, test::plain_config().lines[0]), symrig_wire_Code_CODE_BAD_STATE);
  EXPECT_EQ(bench.host.begin(2, 16), symrig_wire_Code_CODE_BAD_STATE);
  EXPECT_EQ(bench.host.start(), symrig_wire_Code_CODE_BAD_STATE);
  EXPECT_TRUE(bench.host.run_out(100'000));
}

TEST(Core, each_field_of_a_line_is_checked) {
  Bench bench;
  const auto field_of = [&](LineConfig config) {
    symrig_wire_Request request = RawHost::make(symrig_wire_Request_config_line_tag);
    request.body.config_line = {2,
                                symrig_wire_Direction_DIRECTION_OUTPUT,
                                static_cast<symrig_wire_LineRole>(config.role),
                                static_cast<symrig_wire_Hazard>(config.hazard),
                                config.safe_level,
                                config.capture,
                                config.max_on,
                                config.min_off,
                                config.max_duty_permille,
                                config.trip_level};
    const auto reply = bench.host.ask(request);
    return reply && reply->code == symrig_wire_Code_CODE_BAD_VALUE ? reply->field : 0;
  };
  LineConfig good{true, true, 3, 1, false, false, 1000, 1000, 500};
  EXPECT_EQ(field_of(good), 0U);
  LineConfig bad = good;
  bad.role = 6;
  EXPECT_EQ(field_of(bad), 3U);
  bad = good;
  bad.hazard = 3;
  EXPECT_EQ(field_of(bad), 4U);
  bad = good;
  bad.max_on = protocol::kMaxDuration + 1;
  EXPECT_EQ(field_of(bad), 7U);
  bad = good;
  bad.min_off = protocol::kMaxDuration + 1;
  EXPECT_EQ(field_of(bad), 8U);
  bad = good;
  bad.max_duty_permille = 1001;
  EXPECT_EQ(field_of(bad), 9U);
}

TEST(Core, lines_are_what_they_are) {
  Bench bench;
  LineConfig input{true, false, 4, 0, false, true, 0, 0, 0};
  EXPECT_EQ(bench.host.config_line(3, input), 0U);
  EXPECT_EQ(bench.host.config_line(2, input), symrig_wire_Code_CODE_WRONG_DIRECTION);
  EXPECT_EQ(bench.host.config_line(6, input), symrig_wire_Code_CODE_NO_SUCH_LINE);
  input.max_on = 5;  // limits are for outputs
  EXPECT_EQ(bench.host.config_line(3, input), symrig_wire_Code_CODE_BAD_VALUE);
}

TEST(Core, hashes_must_agree) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  ASSERT_EQ(bench.host.upload(short_program()), 0U);
  const std::uint32_t config_hash = bench.host.config_hash;
  bench.host.config_hash ^= 1;
  EXPECT_EQ(bench.host.arm(), symrig_wire_Code_CODE_HASH_MISMATCH);
  bench.host.config_hash = config_hash;
  bench.host.program_hash ^= 1;
  EXPECT_EQ(bench.host.arm(), symrig_wire_Code_CODE_HASH_MISMATCH);
  bench.host.reset_config();
  EXPECT_EQ(bench.host.finalize(1), symrig_wire_Code_CODE_HASH_MISMATCH);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_SAFE);
}

TEST(Core, a_program_too_long_is_refused_before_it_is_sent) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_program_begin_tag);
  request.body.program_begin = {1, 24'576 * 8 + 8};
  const auto reply = bench.host.ask(request);
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->code, symrig_wire_Code_CODE_TOO_LONG);
  EXPECT_EQ(reply->detail, 24'576U * 8U);
  EXPECT_EQ(bench.host.begin(1, 12), symrig_wire_Code_CODE_BAD_VALUE);
  EXPECT_EQ(bench.host.begin(1, 0), symrig_wire_Code_CODE_BAD_VALUE);
}

TEST(Core, a_program_that_breaks_a_rule_is_refused_with_the_rule) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  std::vector<std::uint8_t> bytes;
  test::pack(protocol::make_record(Op::set_word, 1, 1000), bytes);
  test::pack(protocol::make_record(Op::set_word, 0, 2), bytes);
  test::pack(protocol::make_record(Op::end, 0, 0), bytes);
  EXPECT_EQ(bench.host.upload(bytes), symrig_wire_Code_CODE_BAD_PROGRAM);
  const auto reply = bench.host.last_reply();
  ASSERT_TRUE(reply && reply->which_body == symrig_wire_Reply_violation_tag);
  EXPECT_EQ(reply->body.violation.rule, 4U);  // min_dwell
  EXPECT_EQ(reply->body.violation.record, 1U);
  EXPECT_EQ(reply->body.violation.actual, 2U);
  EXPECT_EQ(reply->body.violation.limit, 5U);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_CONFIGURED);
}

/// Fields 3 to 7 of Start are for ways to come, such as a condition. A board that does not know one must not
/// start at once instead.
TEST(Core, a_start_without_a_way_that_the_board_knows_is_refused_and_nothing_moves) {
  const std::vector<std::vector<std::uint8_t>> bodies{{0x4A, 0},                     // start {}
                                                      {0x4A, 2, 0x08, 0},            // now: false
                                                      {0x4A, 2, 0x18, 1},            // field 3, a number
                                                      {0x4A, 4, 0x22, 2, 0x08, 1},   // field 4, a message
                                                      {0x4A, 5, 0x3D, 1, 0, 0, 0}};  // field 7, four bytes
  for (const auto& body : bodies) {
    Bench bench;
    ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
    ASSERT_EQ(bench.host.upload(short_program()), 0U);
    ASSERT_EQ(bench.host.arm(), 0U);
    const std::uint32_t levels = bench.board.levels();
    const auto reply = bench.host.ask_bytes(body);
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->code, symrig_wire_Code_CODE_BAD_VALUE);
    EXPECT_EQ(reply->field, static_cast<std::uint32_t>(symrig_wire_Start_now_tag));
    bench.board.advance_to(bench.board.now() + 1'000'000);
    EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_ARMED);
    EXPECT_EQ(bench.board.levels(), levels);
    EXPECT_EQ(bench.host.start(), 0U);
  }
}

TEST(Core, a_start_in_the_past_is_refused) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  ASSERT_EQ(bench.host.upload(short_program()), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  bench.board.advance_to(5000);
  EXPECT_EQ(bench.host.start_at(4999), symrig_wire_Code_CODE_IN_PAST);
  EXPECT_EQ(bench.host.start_at(5000), 0U);
}

TEST(Core, captured_lines_report_their_edges_and_others_do_not) {
  Bench bench;
  protocol::BoardConfig config = test::plain_config();
  config.lines[4].capture = true;
  ASSERT_EQ(bench.host.configure(config), 0U);
  bench.board.advance_to(777);
  bench.board.set_input(3, true);
  bench.board.set_input(4, true);
  bench.board.advance();
  bench.host.listen();
  ASSERT_EQ(bench.host.events.size(), 1U);
  const symrig_wire_Edge& edge = bench.host.events[0].body.edge;
  EXPECT_EQ(edge.line, 4U);
  EXPECT_TRUE(edge.level);
  EXPECT_EQ(edge.tick, 777U);
}

TEST(Core, every_request_in_every_state_is_answered) {
  for (pb_size_t which = 1; which <= 15; ++which) {
    Bench bench;
    ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
    ASSERT_EQ(bench.host.upload(short_program()), 0U);
    const auto loaded = bench.host.ask_bytes({static_cast<std::uint8_t>(which << 3U | 2U), 0});
    EXPECT_TRUE(loaded.has_value()) << which;
  }
}

}  // namespace
}  // namespace symrig::firmware::core_test
