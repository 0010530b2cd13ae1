// SPDX-License-Identifier: Apache-2.0
// What keeps a board usable: watchdog, light, reboot, verify, what is told after a reset.
#include "raw_host.hpp"
#include "unit/protocol/random_program.hpp"

#include <cstdint>
#include <set>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::upkeep_test {
namespace {

using test::RawHost;

constexpr std::uint64_t kMs = 125'000;  // ticks

std::vector<std::uint8_t> program_of(std::uint32_t words) {
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t k = 0; k < words; ++k)
    test::pack(protocol::make_record(protocol::Op::set_word, 1 + k % 2, 100'000), bytes);
  test::pack(protocol::make_record(protocol::Op::end, 0, 0), bytes);
  return bytes;
}

struct Bench {
  board_sim::SimBoard board;
  RawHost host{board};

  Bench() {
    host.hello();
    EXPECT_EQ(host.configure(test::plain_config()), 0U);
  }
  /// Levels of the light, looked at every millisecond for so long.
  std::vector<bool> light(int ms) {
    std::vector<bool> seen;
    for (int k = 0; k < ms; ++k) {
      board.advance_to(board.now() + kMs);
      host.status();
      seen.push_back(board.light());
    }
    return seen;
  }
};

int changes(const std::vector<bool>& seen) {
  int count = 0;
  for (std::size_t k = 1; k < seen.size(); ++k) count += seen[k] != seen[k - 1] ? 1 : 0;
  return count;
}

TEST(Upkeep, firmware_that_stands_still_is_reset_and_says_so) {
  Bench bench;
  ASSERT_EQ(bench.host.upload(program_of(2'000)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start(), 0U);
  const std::uint64_t stuck = bench.board.now();
  bench.board.stall_firmware_until(stuck + 10'000 * kMs);
  bench.board.advance_to(stuck + (board_sim::kSimWatchdogMs + 1) * kMs);
  EXPECT_EQ(bench.board.levels() & 7U, 0U);
  const auto hello = bench.host.hello();
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->body.hello.reset_fault, static_cast<std::uint32_t>(symrig_wire_FaultCode_FAULT_WATCHDOG));
  const symrig_wire_StatusReply status = bench.host.status();
  EXPECT_EQ(status.state, symrig_wire_State_STATE_SAFE);
  EXPECT_EQ(status.reset_cause, symrig_wire_ResetCause_RESET_CAUSE_WATCHDOG);
  EXPECT_EQ(status.reset_fault.code, symrig_wire_FaultCode_FAULT_WATCHDOG);
  bench.board.reboot();
  EXPECT_EQ(bench.host.hello()->body.hello.reset_fault, 0U);  // told once
}

TEST(Upkeep, the_fault_before_a_reset_is_told_after_it) {
  Bench bench;
  ASSERT_EQ(bench.host.upload(program_of(10)), 0U);
  ASSERT_EQ(bench.host.keep_alive(1), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  bench.board.advance_to(bench.board.now() + 2 * kMs);
  const symrig_wire_Fault fault = bench.host.status().fault;
  ASSERT_EQ(fault.code, symrig_wire_FaultCode_FAULT_KEEP_ALIVE);
  bench.board.reboot();
  bench.host.hello();
  const symrig_wire_StatusReply status = bench.host.status();
  EXPECT_EQ(status.state, symrig_wire_State_STATE_SAFE);
  EXPECT_FALSE(status.has_fault);
  ASSERT_TRUE(status.has_reset_fault);
  EXPECT_EQ(status.reset_fault.code, fault.code);
  EXPECT_EQ(status.reset_fault.tick, fault.tick);
  EXPECT_EQ(status.reset_fault.arg, fault.arg);
  EXPECT_EQ(status.reset_cause, symrig_wire_ResetCause_RESET_CAUSE_POWER);
}

TEST(Upkeep, identify_blinks_fast_for_as_long_as_asked) {
  Bench bench;
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_identify_tag);
  request.body.identify.seconds = 2;
  ASSERT_EQ(bench.host.code(request), 0U);
  // 10 Hz: twenty changes a second, give or take the one at the begin.
  EXPECT_NEAR(changes(bench.light(1000)), 20, 1);
  bench.light(1100);
  EXPECT_LE(changes(bench.light(1000)), 2);  // CONFIGURED: once a second
  request.body.identify.seconds = 61;
  EXPECT_EQ(bench.host.code(request), symrig_wire_Code_CODE_BAD_VALUE);
}

TEST(Upkeep, the_light_tells_a_fault_from_rest) {
  Bench bench;
  ASSERT_EQ(bench.host.upload(program_of(10)), 0U);
  EXPECT_NEAR(changes(bench.light(2000)), 4, 1);
  ASSERT_EQ(bench.host.keep_alive(1), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  EXPECT_NEAR(changes(bench.light(2000)), 20, 1);  // FAULT: 5 Hz
}

symrig_wire_Request reboot_request(std::uint32_t token, bool bootloader) {
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_reboot_tag);
  request.body.reboot = {token, bootloader, false};
  return request;
}

std::uint32_t token_of(RawHost& host) {
  const auto reply = host.hello();
  return protocol::crc32c({reply->body.hello.unique_id.bytes, reply->body.hello.unique_id.size});
}

TEST(Upkeep, a_reboot_takes_the_token_and_answers_first) {
  Bench bench;
  const std::uint32_t token = token_of(bench.host);
  EXPECT_EQ(bench.host.code(reboot_request(token + 1, false)), symrig_wire_Code_CODE_BAD_VALUE);
  ASSERT_EQ(bench.host.set_by_hand(1, 1), 0U);
  ASSERT_EQ(bench.host.code(reboot_request(token, false)), 0U);
  EXPECT_EQ(bench.board.levels() & 7U, 0U);
  bench.board.advance_to(bench.board.now() + 30 * kMs);
  bench.host.hello();
  const symrig_wire_StatusReply status = bench.host.status();
  EXPECT_EQ(status.state, symrig_wire_State_STATE_SAFE);
  EXPECT_EQ(status.reset_cause, symrig_wire_ResetCause_RESET_CAUSE_REQUEST);
}

TEST(Upkeep, the_boot_loader_is_entered_at_rest_only) {
  Bench bench;
  ASSERT_EQ(bench.host.upload(program_of(10)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  const std::uint32_t token = token_of(bench.host);
  EXPECT_EQ(bench.host.code(reboot_request(token, true)), symrig_wire_Code_CODE_BAD_STATE);
  bench.host.abort();
  ASSERT_EQ(bench.host.code(reboot_request(token, true)), 0U);
  EXPECT_FALSE(bench.board.in_bootloader());
  bench.board.advance_to(bench.board.now() + 30 * kMs);
  EXPECT_TRUE(bench.board.in_bootloader());
  EXPECT_FALSE(bench.host.hello());
}

symrig_wire_Request starve_request(std::uint32_t token) {
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_reboot_tag);
  request.body.reboot = {token, false, true};
  return request;
}

TEST(Upkeep, a_watchdog_that_is_starved_resets_the_board) {
  Bench bench;
  ASSERT_EQ(bench.host.set_by_hand(1, 1), 0U);
  ASSERT_EQ(bench.host.code(starve_request(token_of(bench.host))), 0U);
  EXPECT_EQ(bench.board.levels() & 7U, 0U);
  const std::uint64_t starved = bench.board.now();
  // The board still answers, and its answers do not feed the watchdog.
  for (std::uint64_t ms = 50; ms < board_sim::kSimWatchdogMs; ms += 50) {
    bench.board.advance_to(starved + ms * kMs);
    EXPECT_EQ(bench.host.status().reset_cause, symrig_wire_ResetCause_RESET_CAUSE_POWER) << ms;
  }
  bench.board.advance_to(starved + (board_sim::kSimWatchdogMs + 1) * kMs);
  bench.host.hello();
  const symrig_wire_StatusReply status = bench.host.status();
  EXPECT_EQ(status.state, symrig_wire_State_STATE_SAFE);
  EXPECT_EQ(status.reset_cause, symrig_wire_ResetCause_RESET_CAUSE_WATCHDOG);
  EXPECT_EQ(status.reset_fault.code, symrig_wire_FaultCode_FAULT_WATCHDOG);
  // After the reset it is fed again.
  bench.board.advance_to(bench.board.now() + std::uint64_t{3} * board_sim::kSimWatchdogMs * kMs);
  EXPECT_EQ(bench.host.configure(test::plain_config()), 0U);
}

TEST(Upkeep, a_watchdog_is_starved_only_where_outputs_are_safe) {
  Bench bench;
  const std::uint32_t token = token_of(bench.host);
  ASSERT_EQ(bench.host.upload(program_of(2'000)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  EXPECT_EQ(bench.host.code(starve_request(token)), symrig_wire_Code_CODE_BAD_STATE);
  ASSERT_EQ(bench.host.start(), 0U);
  EXPECT_EQ(bench.host.code(starve_request(token)), symrig_wire_Code_CODE_BAD_STATE);
  bench.host.abort();
  EXPECT_EQ(bench.host.code(starve_request(token + 1)), symrig_wire_Code_CODE_BAD_VALUE);
  symrig_wire_Request both = starve_request(token);
  both.body.reboot.bootloader = true;
  const auto refused = bench.host.ask(both);
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->code, symrig_wire_Code_CODE_BAD_VALUE);
  EXPECT_EQ(refused->field, static_cast<std::uint32_t>(symrig_wire_Reboot_starve_watchdog_tag));
  // None of them stopped the feeding.
  bench.board.advance_to(bench.board.now() + std::uint64_t{2} * board_sim::kSimWatchdogMs * kMs);
  EXPECT_EQ(bench.host.status().reset_cause, symrig_wire_ResetCause_RESET_CAUSE_POWER);
}

TEST(Upkeep, nothing_moves_and_nothing_is_stored_before_a_restart) {
  for (const bool starve : {false, true}) {
    Bench bench;
    ASSERT_EQ(bench.host.upload(program_of(10)), 0U);
    const std::uint32_t token = token_of(bench.host);
    ASSERT_EQ(bench.host.code(starve ? starve_request(token) : reboot_request(token, false)), 0U);
    EXPECT_EQ(bench.host.set_by_hand(1, 1), symrig_wire_Code_CODE_BAD_STATE);
    EXPECT_EQ(bench.host.arm(), symrig_wire_Code_CODE_BAD_STATE);
    EXPECT_EQ(bench.host.code(RawHost::make(symrig_wire_Request_store_config_tag)),
              symrig_wire_Code_CODE_BAD_STATE);
    EXPECT_EQ(bench.board.levels() & 7U, 0U);
  }
}

TEST(Upkeep, verify_reads_the_program_again) {
  Bench bench;
  EXPECT_EQ(bench.host.code(RawHost::make(symrig_wire_Request_program_verify_tag)),
            symrig_wire_Code_CODE_BAD_STATE);
  ASSERT_EQ(bench.host.upload(program_of(5'000)), 0U);
  const auto reply = bench.host.ask(RawHost::make(symrig_wire_Request_program_verify_tag));
  ASSERT_TRUE(reply && reply->which_body == symrig_wire_Reply_commit_tag);
  EXPECT_EQ(reply->body.commit.program_hash, bench.host.program_hash);
}

TEST(Upkeep, a_line_says_how_hard_the_program_works_it) {
  Bench bench;
  std::vector<std::uint8_t> bytes;
  // Twice: 300 on, 100 off, 200 on, then off for the wait's latency at least.
  test::pack(protocol::make_loop(2), bytes);
  for (const auto& [levels, ticks] : {std::pair{4U, 300U}, {0U, 100U}, {4U, 200U}, {0U, 5U}})
    test::pack(protocol::make_record(protocol::Op::set_word, levels, ticks), bytes);
  test::pack(protocol::make_wait({3, protocol::WaitFor::rising, false}, 1'000), bytes);
  test::pack(protocol::make_record(protocol::Op::end_loop, 0, 0), bytes);
  test::pack(protocol::make_record(protocol::Op::end, 0, 0), bytes);
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_program_line_tag);
  request.body.program_line.line = 2;
  EXPECT_EQ(bench.host.code(request), symrig_wire_Code_CODE_BAD_STATE);
  ASSERT_EQ(bench.host.upload(bytes), 0U);
  const auto reply = bench.host.ask(request);
  ASSERT_TRUE(reply && reply->which_body == symrig_wire_Reply_line_use_tag);
  EXPECT_EQ(reply->body.line_use.worst_on, 300U);
  EXPECT_EQ(reply->body.line_use.worst_duty_permille, 750U);  // 300 of 400; 200 of 200 + 5 + 125 is less
  request.body.program_line.line = 3;
  EXPECT_EQ(bench.host.code(request), symrig_wire_Code_CODE_WRONG_DIRECTION);
  request.body.program_line.line = 30;
  EXPECT_EQ(bench.host.code(request), symrig_wire_Code_CODE_NO_SUCH_LINE);
}

TEST(Upkeep, a_time_ping_may_be_urgent_and_needs_no_session) {
  board_sim::SimBoard board;
  RawHost host(board);
  symrig_wire_Request request = RawHost::make(symrig_wire_Request_time_ping_tag);
  request.body.time_ping.host_ns = 77;
  board.advance_to(4'000);
  const auto reply = host.ask(request, protocol::flag::urgent);
  ASSERT_TRUE(reply && reply->which_body == symrig_wire_Reply_time_tag);
  EXPECT_EQ(reply->body.time.host_ns, 77U);
  EXPECT_EQ(reply->body.time.rx_tick, 4'000U);
}

}  // namespace
}  // namespace symrig::firmware::upkeep_test
