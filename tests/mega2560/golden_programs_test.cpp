// SPDX-License-Identifier: Apache-2.0
// The same programs on the simulated board and on the emulated Mega: the same edges, to three ticks (one at
// each end, and the first edge may be off too). They are the programs of the Pico's golden test (nested
// loops, shortest words, waits, a scan), slower, because this board needs a millisecond for a record.
#include "golden_programs.hpp"

#include "assert_ok.hpp"
#include "emulated_mega.hpp"
#include "symrig/conformance/conformance.hpp"
#include "symrig/program/compile.hpp"

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::test::mega_golden_programs_test {
namespace {

using namespace std::chrono_literals;
constexpr unsigned kOutputs = 6;
constexpr unsigned kVsync = 6;
constexpr std::uint64_t kCyclesPerTick = 8;

GoldenRun run_on_mega(EmulatedMega& mega, Board& board, const Program& program, Nanoseconds vsync) {
  GoldenRun run;
  EXPECT_TRUE(board.upload(program).ok());
  EXPECT_TRUE(board.arm().ok());
  if (vsync.count() > 0) {
    const auto period = static_cast<std::uint64_t>(vsync.count()) * 16 / 1000;
    for (std::uint64_t k = 0, at = mega.cycle() + 1000; k < 400; ++k, at += period) {
      mega.set_input_at(at, kVsync, true);
      mega.set_input_at(at + period / 4, kVsync, false);
    }
  }
  mega.edges();
  EXPECT_TRUE(board.start().ok());
  auto receipt = board.wait(20s);
  EXPECT_TRUE(receipt.ok());
  if (!receipt) return run;
  run.receipt = *receipt;
  const auto edges = mega.edges();
  const auto first =
      std::find_if(edges.begin(), edges.end(), [](const MegaEdge& e) { return e.line < kOutputs; });
  EXPECT_NE(first, edges.end());
  if (first == edges.end()) return run;
  for (const MegaEdge& edge : edges) {
    const auto cycles = static_cast<std::int64_t>(edge.cycle) - static_cast<std::int64_t>(first->cycle);
    const double tick = static_cast<double>(cycles) / static_cast<double>(kCyclesPerTick);
    if (edge.line < kOutputs) run.changes.push_back({tick, edge.line, edge.level});
    if (edge.line == kVsync && (edge.level || !run.vsync.empty()))
      run.vsync.push_back(cycles / static_cast<std::int64_t>(kCyclesPerTick));
  }
  return run;
}

Result<Program> nested(const BoardInfo& info) {
  ProgramBuilder program(info);
  program.set("aux0", true).hold(10ms);
  program.loop(3).set("aux1", true).hold(4ms).set("aux1", false).hold(4ms);
  program.loop(2).set("projector_trigger", true).hold(6ms);
  program.loop(3).mark(7).pulse("camera_trigger", 5ms).hold(7ms);
  program.loop(4).pulse("lamp_enable", 3ms).hold(3ms + 500ns).end_loop();
  program.end_loop().set("projector_trigger", false).hold(8ms).end_loop();
  return program.end_loop().set("aux0", false).hold(1ms).end();
}

/// As many shortest words in a row as the queue has room for, then a rest in which it is filled again.
Result<Program> shortest(const BoardInfo& info) {
  ProgramBuilder program(info);
  for (unsigned k = 0; k < 5; ++k) {
    for (unsigned j = 0; j < 5; ++j)
      program.set("aux0", j % 2 == 0).set("aux1", j % 3 == 0).hold(info.min_dwell);
    program.hold(30ms);
  }
  return program.set("aux0", false).set("aux1", false).hold(5ms).end();
}

Result<Program> waits(const BoardInfo& info) {
  ProgramBuilder program(info);
  program.set("aux1", true).hold(10ms).loop(10);
  program.wait_edge("vsync", EdgeKind::rising, 60ms, OnTimeout::abort)
      .mark(1)
      .pulse("camera_trigger", 3ms)
      .hold(2ms);
  program.wait_edge("vsync", EdgeKind::falling, 60ms, OnTimeout::abort).pulse("aux0", 2ms).hold(3ms);
  return program.end_loop().set("aux1", false).hold(1ms).end();
}

/// Two patterns with brackets of three: what a scan is.
Result<Program> scan(const BoardInfo& info) {
  RigSetup rig = default_rig_setup();
  rig.projector.refresh = 50ms;
  rig.projector.vsync_timeout = 200ms;
  rig.projector.advance_pulse = 2ms;
  rig.projector.settle = 3ms;
  rig.camera.readout = 4ms;
  const std::vector<std::vector<Nanoseconds>> brackets(2, {2ms, 5ms, 12ms});
  SYMRIG_TRY(const CompiledProgram compiled, compile_brackets(rig, info, brackets));
  return compiled.program;
}

const std::vector<GoldenProgram>& goldens() {
  // Ticks; after waits also how late an interrupt stamps the awaited edge.
  static const std::vector<GoldenProgram> kGoldens{{"nested", nested, Nanoseconds{0}, 3},
                                                   {"shortest", shortest, Nanoseconds{0}, 3},
                                                   {"waits", waits, 40'003us, 80},
                                                   {"scan", scan, 50'003us, 80}};
  return kGoldens;
}

class MegaGoldenPrograms : public testing::TestWithParam<GoldenProgram> {};

TEST_P(MegaGoldenPrograms, give_the_same_edges_on_both_boards) {
  NEEDS_MEGA();
  EmulatedMega mega;
  auto board = Board::connect(mega.link());
  ASSERT_OK(board);
  ASSERT_OK(board->configure({}));
  const auto program = GetParam().make(board->info());
  ASSERT_OK(program);
  const GoldenRun real = run_on_mega(mega, *board, *program, GetParam().vsync_period);
  const GoldenRun simulated = golden_run_on_sim(board->info(), *program, real.vsync, 0);
  expect_same_run(real, simulated);
  ASSERT_EQ(real.changes.size(), simulated.changes.size());
  double off = 0;
  for (std::size_t k = 0; k < real.changes.size(); ++k) {
    EXPECT_EQ(real.changes[k].line, simulated.changes[k].line) << k;
    EXPECT_EQ(real.changes[k].level, simulated.changes[k].level) << k;
    off = std::max(off, std::abs(real.changes[k].tick - simulated.changes[k].tick));
  }
  EXPECT_LE(off, GetParam().tolerance);
  std::printf("%s: %zu records, %zu edges, at most %.2f ticks apart\n", GetParam().name, program->records(),
              real.changes.size(), off);
}

INSTANTIATE_TEST_SUITE_P(Mega, MegaGoldenPrograms, testing::ValuesIn(goldens()),
                         [](const auto& each) { return std::string(each.param.name); });

// The whole conformance kit over the UART, with the wire that some checks ask for.

constexpr unsigned kAux0 = 4;
constexpr unsigned kStackKept = 96;  // bytes that no test has reached

TEST(EmulatedMega, passes_the_conformance_kit_with_a_wire) {
  NEEDS_MEGA();
  EmulatedMega mega;
  mega.jumper(kAux0, 9);
  ConformanceOptions options;
  options.jumper = Jumper{"aux0", "interlock"};
  options.on_result = [](const CheckResult& result) {
    EXPECT_NE(result.outcome, CheckOutcome::failed) << result.name << ": " << result.detail;
  };
  const auto report = check_conformance(mega.link(), options);
  ASSERT_OK(report);
  // No room for three chunks of a program, and no edge that the board cannot wait for.
  EXPECT_EQ(report->count(CheckOutcome::skipped), 2U);
  EXPECT_GE(mega.stack_left(), kStackKept);
  std::printf("%zu passed, %zu failed, %zu skipped; %u of %u bytes of stack never used\n",
              report->count(CheckOutcome::passed), report->count(CheckOutcome::failed),
              report->count(CheckOutcome::skipped), mega.stack_left(), mega.stack_room());
}

}  // namespace
}  // namespace symrig::test::mega_golden_programs_test
