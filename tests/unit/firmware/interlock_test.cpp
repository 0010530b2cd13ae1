// SPDX-License-Identifier: Apache-2.0
// Interlock inputs: nothing moves while one is open, and everything falls to its safe levels when one opens.
#include "raw_host.hpp"
#include "symrig/firmware/link.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::interlock_test {
namespace {

using test::Chatter;
using test::RawHost;
using test::Recorder;

constexpr int kInterlock = 5;
constexpr std::uint32_t kSafe = 2;  // line 1 rests high

/// Line 5 is an interlock that trips at `trip_level`; line 1 has a high safe level.
protocol::BoardConfig config_of(bool trip_level) {
  protocol::BoardConfig config = test::plain_config();
  config.lines[1].safe_level = true;
  config.lines[kInterlock].configured = true;
  config.lines[kInterlock].role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  config.lines[kInterlock].trip_level = trip_level;
  return config;
}

/// One long word, all outputs on but line 1.
std::vector<std::uint8_t> long_program() {
  std::vector<std::uint8_t> bytes;
  test::pack(protocol::make_record(protocol::Op::set_word, 5, 1'000'000), bytes);
  test::pack(protocol::make_record(protocol::Op::end, kSafe, 0), bytes);
  return bytes;
}

struct Bench {
  board_sim::SimBoard board;
  Recorder recorder;
  RawHost host{board};

  explicit Bench(bool trip_level) {
    board.attach(recorder);
    host.hello();
    EXPECT_EQ(host.configure(config_of(trip_level)), 0U);
    EXPECT_EQ(host.upload(long_program()), 0U);
  }
  std::uint32_t levels() const { return board.levels() & 7U; }
};

TEST(Interlock, nothing_is_armed_or_set_by_hand_while_it_is_open) {
  for (const bool trip_level : {false, true}) {
    Bench bench(trip_level);
    bench.board.set_input(kInterlock, trip_level);
    const auto reply = [&] {
      symrig_wire_Request request = RawHost::make(symrig_wire_Request_arm_tag);
      request.body.arm = {bench.host.program_hash, bench.host.config_hash, false};
      return bench.host.ask(request);
    }();
    ASSERT_TRUE(reply);
    EXPECT_EQ(reply->code, symrig_wire_Code_CODE_INTERLOCK_OPEN);
    EXPECT_EQ(reply->detail, 5U);
    EXPECT_EQ(bench.host.set_by_hand(1, 1), symrig_wire_Code_CODE_INTERLOCK_OPEN);
    EXPECT_EQ(bench.levels(), kSafe);
    bench.board.set_input(kInterlock, !trip_level);
    EXPECT_EQ(bench.host.arm(), 0U);
  }
}

TEST(Interlock, opening_it_makes_safe_in_the_same_tick_without_firmware) {
  Bench bench(true);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  bench.board.advance_to(bench.board.now() + 1000);
  ASSERT_EQ(bench.levels(), 5U);
  bench.board.stall_firmware_until(bench.board.now() + 10'000);
  const std::uint64_t opened = bench.board.now();
  bench.board.set_input(kInterlock, true);
  EXPECT_EQ(bench.levels(), kSafe);
  EXPECT_EQ(bench.recorder.changes.back(), (Recorder::Change{opened, kSafe}));
  ASSERT_TRUE(bench.host.run_out(1'000'000));
  const symrig_wire_StatusReply status = bench.host.status();
  EXPECT_EQ(status.state, symrig_wire_State_STATE_FAULT);
  EXPECT_EQ(status.fault.code, symrig_wire_FaultCode_FAULT_INTERLOCK);
  EXPECT_EQ(status.fault.arg, 5U);
  EXPECT_EQ(bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done.end,
            symrig_wire_RunEnd_RUN_END_FAULT);
}

/// Half periods in ticks of 8 ns: 1 kHz to 1 MHz. The host takes no event, so the log of the edges overflows.
TEST(Interlock, inputs_that_chatter_delay_neither_a_trip_nor_an_abort) {
  for (const std::uint64_t half_period : {62'500, 625, 62})
    for (const bool abort : {false, true}) {
      Bench bench(true);
      Chatter chatter(half_period);
      bench.board.attach(chatter);
      ASSERT_EQ(bench.host.configure(Chatter::captured(config_of(true))), 0U);
      ASSERT_EQ(bench.host.upload(long_program()), 0U);
      ASSERT_EQ(bench.host.arm(), 0U);
      ASSERT_EQ(bench.host.start(), 0U);
      bench.board.advance_to(bench.board.now() + 500'000);
      ASSERT_EQ(bench.levels(), 5U) << half_period;
      const std::uint64_t asked = bench.board.now();
      if (abort)
        bench.host.abort();
      else
        bench.board.set_input(kInterlock, true);
      EXPECT_EQ(bench.recorder.changes.back(), (Recorder::Change{asked, kSafe})) << half_period;
      bench.board.advance_to(asked + 1'000);
      EXPECT_EQ(bench.levels(), kSafe);
      EXPECT_EQ(bench.host.status().state,
                abort ? symrig_wire_State_STATE_LOADED : symrig_wire_State_STATE_FAULT);
    }
}

TEST(Interlock, a_short_opening_is_not_missed) {
  Bench bench(true);
  ASSERT_EQ(bench.host.arm(), 0U);
  bench.board.stall_firmware_until(bench.board.now() + 10'000);
  bench.board.set_input(kInterlock, true);
  bench.board.set_input(kInterlock, false);
  bench.board.advance_to(bench.board.now() + 20'000);
  EXPECT_EQ(bench.host.status().fault.code, symrig_wire_FaultCode_FAULT_INTERLOCK);
}

TEST(Interlock, opening_it_at_rest_is_no_fault) {
  Bench bench(true);
  bench.board.set_input(kInterlock, true);
  bench.board.advance_to(bench.board.now() + 10'000);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_LOADED);
}

TEST(Interlock, a_line_set_by_hand_falls_too) {
  Bench bench(false);
  bench.board.set_input(kInterlock, true);
  ASSERT_EQ(bench.host.set_by_hand(1, 1), 0U);
  ASSERT_EQ(bench.levels(), 1U | kSafe);
  bench.board.set_input(kInterlock, false);
  EXPECT_EQ(bench.levels(), kSafe);
  bench.board.advance_to(bench.board.now() + 10);
  EXPECT_EQ(bench.host.status().fault.code, symrig_wire_FaultCode_FAULT_INTERLOCK);
}

TEST(Interlock, after_the_fault_is_cleared_everything_works_again) {
  Bench bench(true);
  ASSERT_EQ(bench.host.arm(), 0U);
  bench.board.set_input(kInterlock, true);
  bench.board.advance_to(bench.board.now() + 10);
  ASSERT_EQ(bench.host.state(), symrig_wire_State_STATE_FAULT);
  ASSERT_EQ(bench.host.clear_fault(symrig_wire_FaultCode_FAULT_INTERLOCK), 0U);
  ASSERT_EQ(bench.host.configure(config_of(true)), 0U);
  ASSERT_EQ(bench.host.upload(long_program()), 0U);
  EXPECT_EQ(bench.host.arm(), symrig_wire_Code_CODE_INTERLOCK_OPEN);
  bench.board.set_input(kInterlock, false);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  ASSERT_TRUE(bench.host.run_out(2'000'000));
  EXPECT_EQ(bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done.end,
            symrig_wire_RunEnd_RUN_END_COMPLETED);
}

TEST(Interlock, only_inputs_can_be_one_and_only_they_have_a_trip_level) {
  board_sim::SimBoard board;
  RawHost host(board);
  host.hello();
  protocol::LineConfig output;
  output.configured = true;
  output.output = true;
  output.role = symrig_wire_LineRole_LINE_ROLE_INTERLOCK;
  EXPECT_EQ(host.config_line(0, output), symrig_wire_Code_CODE_BAD_VALUE);
  protocol::LineConfig input;
  input.configured = true;
  input.trip_level = true;
  EXPECT_EQ(host.config_line(5, input), symrig_wire_Code_CODE_BAD_VALUE);
}

using protocol::Kind;
using Bytes = std::vector<std::uint8_t>;

Bytes frame(Kind kind, std::uint8_t flags, const Bytes& body) {
  Bytes wire(protocol::kMaxWire);
  wire.resize(protocol::encode_frame({protocol::kProtoMajor, kind, 0x1234, 7, 8, flags},
                                     {body.data(), body.size()}, {wire.data(), wire.size()}));
  return wire;
}

Bytes abort_body() {
  symrig_wire_Request request = symrig_wire_Request_init_zero;
  request.which_body = symrig_wire_Request_abort_tag;
  protocol::BodyBuffer buffer{};
  const std::size_t size = encode(request, buffer);
  return {buffer.bytes, buffer.bytes + size};
}

/// Bytes after which it says "abort", counted from 1; 0 = never.
std::size_t found_at(UrgentScan& scan, const Bytes& bytes) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    if (scan.push(bytes[i])) found = i + 1;
  return found;
}

TEST(UrgentScan, finds_an_abort_with_its_last_byte) {
  UrgentScan scan;
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  EXPECT_EQ(found_at(scan, urgent), urgent.size());
  EXPECT_EQ(found_at(scan, urgent), urgent.size());  // and again
}

TEST(UrgentScan, finds_nothing_else) {
  UrgentScan scan;
  symrig_wire_Request ping = symrig_wire_Request_init_zero;
  ping.which_body = symrig_wire_Request_time_ping_tag;
  protocol::BodyBuffer buffer{};
  const std::size_t size = encode(ping, buffer);
  EXPECT_EQ(found_at(scan, frame(Kind::request, protocol::flag::urgent, {buffer.bytes, buffer.bytes + size})),
            0U);
  EXPECT_EQ(found_at(scan, frame(Kind::request, 0, abort_body())), 0U);
  EXPECT_EQ(found_at(scan, frame(Kind::data, protocol::flag::urgent, abort_body())), 0U);
  EXPECT_EQ(found_at(scan, frame(Kind::request, protocol::flag::urgent | protocol::flag::sync, abort_body())),
            0U);
  EXPECT_EQ(found_at(scan, frame(Kind::request, protocol::flag::urgent, {})), 0U);
}

TEST(UrgentScan, a_damaged_abort_is_none_and_the_next_one_is_found) {
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  for (std::size_t at = 0; at + 1 < urgent.size(); ++at) {
    UrgentScan scan;
    Bytes damaged = urgent;
    damaged[at] ^= 0x41;
    EXPECT_EQ(found_at(scan, damaged), 0U) << at;
    EXPECT_EQ(found_at(scan, urgent), urgent.size()) << at;
  }
}

// A changed code byte breaks the blocks of COBS; any other changed byte is a burst that CRC-32C always finds.
TEST(UrgentScan, no_change_of_a_byte_makes_or_leaves_an_abort) {
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  for (std::size_t at = 0; at < urgent.size(); ++at)
    for (unsigned change = 1; change < 256; ++change) {
      UrgentScan scan;
      Bytes damaged = urgent;
      damaged[at] = static_cast<std::uint8_t>(damaged[at] ^ change);
      EXPECT_EQ(found_at(scan, damaged), 0U) << at << ' ' << change;
    }
}

// Zeros in the header's fields move the blocks of COBS; frames of any length may come before.
TEST(UrgentScan, finds_every_abort_behind_every_frame) {
  UrgentScan scan;
  const Bytes body = abort_body();
  for (unsigned seq = 0; seq < 0x10000; seq += 0x101)
    for (const unsigned ack : {0x0000U, 0x0001U, 0x0100U, 0xffffU}) {
      Bytes wire(protocol::kMaxWire);
      wire.resize(
          protocol::encode_frame({protocol::kProtoMajor, Kind::request, static_cast<std::uint16_t>(seq),
                                  static_cast<std::uint16_t>(ack), 0, protocol::flag::urgent},
                                 {body.data(), body.size()}, {wire.data(), wire.size()}));
      const Bytes before = frame(Kind::data, 0, Bytes(seq % 500, static_cast<std::uint8_t>(ack)));
      EXPECT_EQ(found_at(scan, before), 0U);
      EXPECT_EQ(found_at(scan, wire), wire.size()) << seq << ' ' << ack;
    }
}

TEST(UrgentScan, a_new_end_of_the_link_begins_afresh) {
  UrgentScan scan;
  const Bytes urgent = frame(Kind::request, protocol::flag::urgent, abort_body());
  for (std::size_t i = 0; i < 5; ++i) scan.push(urgent[i]);
  scan.restart();
  EXPECT_EQ(found_at(scan, urgent), urgent.size());
}

}  // namespace
}  // namespace symrig::firmware::interlock_test
