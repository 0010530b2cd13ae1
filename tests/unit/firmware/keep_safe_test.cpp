// SPDX-License-Identifier: Apache-2.0
// Whatever breaks, outputs end at their safe levels. Each test breaks one layer on purpose.
#include "raw_host.hpp"
#include "unit/protocol/random_program.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::keep_safe_test {
namespace {

using protocol::BoardConfig;
using protocol::Op;
using test::Chatter;
using test::RawHost;
using test::Recorder;

constexpr std::uint64_t kMs = 125'000;  // ticks

/// Line 2 is a lamp with the limits given; line 1 has a high safe level.
BoardConfig lamp_config(std::uint64_t max_on, std::uint64_t min_off = 0, std::uint16_t duty = 0) {
  BoardConfig config = test::plain_config();
  config.lines[1].safe_level = true;
  config.lines[2].hazard = 1;
  config.lines[2].max_on = max_on;
  config.lines[2].min_off = min_off;
  config.lines[2].max_duty_permille = duty;
  return config;
}

constexpr std::uint32_t kSafe = 2;
constexpr std::uint32_t kLamp = 4;

std::vector<std::uint8_t> program_of(const std::vector<protocol::Record>& records) {
  std::vector<std::uint8_t> bytes;
  for (const protocol::Record& record : records) test::pack(record, bytes);
  return bytes;
}

protocol::Record word(std::uint32_t levels, std::uint64_t ticks) {
  return protocol::make_record(Op::set_word, levels, static_cast<std::uint32_t>(ticks));
}
protocol::Record end(std::uint32_t levels) {
  return protocol::make_record(Op::end, levels, 0);
}

struct Bench {
  board_sim::SimBoard board;
  Recorder recorder;
  RawHost host{board};

  Bench() {
    board.attach(recorder);
    host.hello();
  }
  std::uint32_t levels() const { return board.levels() & 7U; }
  void run(const BoardConfig& config, const std::vector<std::uint8_t>& program, std::uint32_t ttl_ms = 1000) {
    ASSERT_EQ(host.configure(config), 0U);
    ASSERT_EQ(host.upload(program), 0U);
    ASSERT_EQ(host.keep_alive(ttl_ms), 0U);
    ASSERT_EQ(host.arm(), 0U);
    ASSERT_EQ(host.start(), 0U);
  }
  void expect_fault(symrig_wire_FaultCode code, std::uint64_t arg) {
    const symrig_wire_StatusReply status = host.status();
    EXPECT_EQ(status.state, symrig_wire_State_STATE_FAULT);
    ASSERT_TRUE(status.has_fault);
    EXPECT_EQ(status.fault.code, code);
    EXPECT_EQ(status.fault.arg, arg);
    EXPECT_EQ(levels(), kSafe);
  }
};

TEST(KeepSafe, safe_levels_stand_from_the_moment_they_are_configured) {
  Bench bench;
  EXPECT_EQ(bench.levels(), 0U);
  ASSERT_EQ(bench.host.configure(lamp_config(0)), 0U);
  EXPECT_EQ(bench.levels(), kSafe);
}

TEST(KeepSafe, silence_makes_a_run_fault_when_the_keep_alive_runs_out) {
  Bench bench;
  bench.run(lamp_config(0), program_of({word(kLamp, 4000 * kMs), end(kSafe)}), 100);
  const std::uint64_t asked = bench.board.now();
  bench.board.advance_to(asked + 100 * kMs - 1);
  EXPECT_EQ(bench.levels(), kLamp);
  bench.board.advance_to(asked + 100 * kMs);
  EXPECT_EQ(bench.levels(), kSafe);
  EXPECT_EQ(bench.recorder.changes.back().tick, asked + 100 * kMs);
  bench.expect_fault(symrig_wire_FaultCode_FAULT_KEEP_ALIVE, 100);
}

TEST(KeepSafe, keep_alives_in_time_keep_it_running) {
  Bench bench;
  bench.run(lamp_config(0), program_of({word(kLamp, 4000 * kMs), end(kSafe)}), 100);
  for (int k = 0; k < 60; ++k) {
    bench.board.advance_to(bench.board.now() + 99 * kMs);
    bench.host.keep_alive(100);
    bench.host.listen();
  }
  EXPECT_TRUE(bench.host.done());
  EXPECT_EQ(bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done.end,
            symrig_wire_RunEnd_RUN_END_COMPLETED);
}

TEST(KeepSafe, a_lamp_is_not_armed_without_a_keep_alive) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(lamp_config(0)), 0U);
  ASSERT_EQ(bench.host.upload(program_of({word(kLamp, kMs), end(kSafe)})), 0U);
  EXPECT_EQ(bench.host.arm(), symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED);
  bench.host.keep_alive(1000);
  EXPECT_EQ(bench.host.arm(), 0U);
}

TEST(KeepSafe, a_lamp_left_on_after_the_run_goes_off_with_the_host) {
  Bench bench;
  bench.run(lamp_config(0), program_of({word(kLamp, kMs), end(kLamp)}), 100);
  ASSERT_TRUE(bench.host.run_out(50 * kMs));
  EXPECT_EQ(bench.levels(), kLamp);
  bench.board.advance_to(bench.board.now() + 200 * kMs);
  bench.expect_fault(symrig_wire_FaultCode_FAULT_KEEP_ALIVE, 100);
}

TEST(KeepSafe, silence_after_a_run_that_ended_safe_is_no_fault) {
  Bench bench;
  bench.run(lamp_config(0), program_of({word(kLamp, kMs), end(kSafe)}), 100);
  ASSERT_TRUE(bench.host.run_out(50 * kMs));
  bench.board.advance_to(bench.board.now() + 200 * kMs);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_LOADED);
}

TEST(KeepSafe, a_pulled_cable_is_a_fault) {
  Bench bench;
  bench.run(lamp_config(0), program_of({word(kLamp, 4000 * kMs), end(kSafe)}));
  bench.board.advance_to(bench.board.now() + kMs);
  bench.board.set_attached(false);
  bench.board.advance();
  EXPECT_EQ(bench.levels(), kSafe);
  bench.board.set_attached(true);
  bench.host.hello();
  bench.expect_fault(symrig_wire_FaultCode_FAULT_LINK_LOST, 0);
}

TEST(KeepSafe, the_guard_trips_where_validation_was_passed_by) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(lamp_config(10 * kMs)), 0U);
  bench.board.advance_to(kMs);
  bench.board.force_segment(kLamp | kSafe, static_cast<std::uint32_t>(50 * kMs));
  bench.board.advance_to(100 * kMs);
  const std::vector<Recorder::Change> tail(bench.recorder.changes.end() - 2, bench.recorder.changes.end());
  const std::vector<Recorder::Change> expected{{kMs, kLamp | kSafe}, {kMs + 10 * kMs + 1, kSafe}};
  EXPECT_EQ(tail, expected);
  bench.expect_fault(symrig_wire_FaultCode_FAULT_MAX_ON, 2);
}

/// Half periods in ticks: 1 kHz to 1 MHz.
TEST(KeepSafe, inputs_that_chatter_delay_neither_the_keep_alive_nor_the_guard) {
  for (const std::uint64_t half_period : {62'500, 625, 62})
    for (const bool silent : {true, false}) {
      Bench bench;
      Chatter chatter(half_period);
      bench.board.attach(chatter);
      const BoardConfig config = Chatter::captured(lamp_config(silent ? 0 : 10 * kMs));
      if (silent) {
        bench.run(config, program_of({word(kLamp, 4000 * kMs), end(kSafe)}), 100);
      } else {
        ASSERT_EQ(bench.host.configure(config), 0U);
        bench.board.advance_to(kMs);
        bench.board.force_segment(kLamp | kSafe, static_cast<std::uint32_t>(50 * kMs));
      }
      const std::uint64_t from = bench.board.now(), limit = silent ? 100 * kMs : 10 * kMs + 1;
      bench.board.advance_to(from + 150 * kMs);
      EXPECT_EQ(bench.recorder.changes.back(), (Recorder::Change{from + limit, kSafe})) << half_period;
      bench.expect_fault(silent ? symrig_wire_FaultCode_FAULT_KEEP_ALIVE : symrig_wire_FaultCode_FAULT_MAX_ON,
                         silent ? 100 : 2);
    }
}

TEST(KeepSafe, the_guard_sees_a_rest_that_is_too_short) {
  Bench bench;
  ASSERT_EQ(bench.host.configure(lamp_config(0, 5 * kMs)), 0U);
  bench.board.force_segment(kLamp, static_cast<std::uint32_t>(kMs));
  bench.board.advance_to(2 * kMs);
  bench.board.force_segment(0, static_cast<std::uint32_t>(kMs));
  bench.board.advance_to(4 * kMs);
  bench.board.force_segment(kLamp, static_cast<std::uint32_t>(kMs));
  bench.board.advance_to(100 * kMs);
  bench.expect_fault(symrig_wire_FaultCode_FAULT_MIN_OFF, 2);
}

TEST(KeepSafe, a_hot_lamp_is_not_started_again) {
  Bench bench;
  const BoardConfig config = lamp_config(0, 0, 500);
  bench.run(config, program_of({word(kLamp, 100 * kMs), end(kSafe)}));
  ASSERT_TRUE(bench.host.run_out(500 * kMs));
  const std::uint64_t ended = bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done.tick;
  ASSERT_EQ(bench.host.arm(), 0U);
  EXPECT_EQ(bench.host.start(), symrig_wire_Code_CODE_COOLING);
  EXPECT_EQ(bench.host.start_at(ended + 100 * kMs - 1), symrig_wire_Code_CODE_COOLING);
  EXPECT_EQ(bench.host.start_at(ended + 100 * kMs), 0U);
}

TEST(KeepSafe, a_fault_stays_latched_until_it_is_cleared_by_its_name) {
  Bench bench;
  bench.run(lamp_config(0), program_of({word(kLamp, 4000 * kMs), end(kSafe)}), 100);
  bench.board.advance_to(bench.board.now() + 200 * kMs);
  bench.expect_fault(symrig_wire_FaultCode_FAULT_KEEP_ALIVE, 100);
  EXPECT_EQ(bench.host.arm(), symrig_wire_Code_CODE_BAD_STATE);
  EXPECT_EQ(bench.host.reset_config(), symrig_wire_Code_CODE_BAD_STATE);
  EXPECT_EQ(bench.host.clear_fault(symrig_wire_FaultCode_FAULT_DUTY), symrig_wire_Code_CODE_BAD_VALUE);
  EXPECT_EQ(bench.host.clear_fault(symrig_wire_FaultCode_FAULT_KEEP_ALIVE), 0U);
  const symrig_wire_StatusReply status = bench.host.status();
  EXPECT_EQ(status.state, symrig_wire_State_STATE_SAFE);
  EXPECT_FALSE(status.has_fault);
  EXPECT_EQ(status.config_hash, 0U);
  EXPECT_EQ(status.program_hash, 0U);
  EXPECT_EQ(bench.levels(), kSafe);
}

TEST(KeepSafe, a_fault_is_remembered_over_a_reset) {
  Bench bench;
  bench.run(lamp_config(0), program_of({word(kLamp, 4000 * kMs), end(kSafe)}), 100);
  bench.board.advance_to(bench.board.now() + 200 * kMs);
  bench.board.reboot();
  EXPECT_EQ(bench.levels(), 0U);
  const auto reply = bench.host.hello();
  ASSERT_TRUE(reply.has_value());
  EXPECT_EQ(reply->body.hello.reset_fault,
            static_cast<std::uint32_t>(symrig_wire_FaultCode_FAULT_KEEP_ALIVE));
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_SAFE);
}

/// Longest time that line 2 was on in a recording that ends at `now`.
std::uint64_t longest_pulse(const std::vector<Recorder::Change>& changes, std::uint64_t now) {
  std::uint64_t longest = 0;
  std::uint64_t since = 0;
  bool on = false;
  const auto note = [&](std::uint64_t tick) {
    if (on) longest = std::max(longest, tick - since);
  };
  for (const Recorder::Change& change : changes) {
    const bool level = (change.levels & kLamp) != 0;
    if (level == on) continue;
    note(change.tick);
    on = level;
    since = change.tick;
  }
  note(now);
  return longest;
}

TEST(KeepSafe, no_random_program_keeps_a_lamp_on_beyond_its_limit) {
  int accepted = 0;
  int refused = 0;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    test::Random random(seed);
    test::TreeOptions options;
    options.wait_percent = 15;
    test::ProgramTree tree = test::random_tree(random, options);
    tree.final_levels = kSafe;
    Bench bench;
    const std::uint64_t max_on = random.range(30, 600);
    ASSERT_EQ(bench.host.configure(lamp_config(max_on)), 0U);
    const std::uint32_t code = bench.host.upload(test::pack(tree));
    if (code == symrig_wire_Code_CODE_BAD_PROGRAM) {
      ++refused;
      continue;
    }
    ASSERT_EQ(code, 0U);
    ++accepted;
    bench.host.keep_alive(60'000);
    ASSERT_EQ(bench.host.arm(), 0U);
    ASSERT_EQ(bench.host.start(), 0U);
    if (random.chance(30)) bench.board.stall_firmware_until(bench.board.now() + random.range(1, 2000));
    ASSERT_TRUE(bench.host.run_out(std::uint64_t{1} << 32U));
    const bool stalled = bench.host.state() == symrig_wire_State_STATE_FAULT;
    if (!stalled) {
      EXPECT_LE(longest_pulse(bench.recorder.changes, bench.board.now()), max_on) << seed;
    }
    EXPECT_EQ(bench.levels(), kSafe);
  }
  EXPECT_GT(accepted, 50);
  EXPECT_GT(refused, 50);
}

TEST(KeepSafe, an_engine_that_plays_on_beyond_the_end_does_not_stop_time) {
  Bench bench;
  bench.run(lamp_config(kMs), program_of({word(kLamp | kSafe, kMs / 2), word(kSafe, kMs), end(kSafe)}));
  bench.board.force_segment(kLamp | kSafe, 8 * kMs);
  const std::uint64_t until = bench.board.now() + 20 * kMs;
  int events = 0;
  while (bench.board.now() < until && events < 10'000 && bench.board.advance()) ++events;
  EXPECT_LT(events, 10'000);
  EXPECT_EQ(bench.host.status().fault.code, symrig_wire_FaultCode_FAULT_MAX_ON);
  EXPECT_EQ(bench.levels(), kSafe);
}

}  // namespace
}  // namespace symrig::firmware::keep_safe_test
