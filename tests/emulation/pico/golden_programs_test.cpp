// SPDX-License-Identifier: Apache-2.0
// The same programs on the simulated board and on the emulated Pico: the same edges, to the tick. The
// simulated board gets the Pico's lines and timing, so that the programs are the same bytes; and it sees the
// very pulses that the Pico saw.
#include "golden_programs.hpp"

#include "emulated_pico.hpp"
#include "symrig/board/self_test.hpp"
#include "symrig/conformance/conformance.hpp"
#include "symrig/program/compile.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::test::golden_programs_test {
namespace {

using namespace std::chrono_literals;

constexpr unsigned kOutputs = 12;

GoldenRun run_on_pico(EmulatedPico& pico, Board& board, const Program& program) {
  GoldenRun run;
  EXPECT_TRUE(board.upload(program).ok());
  EXPECT_TRUE(board.arm().ok());
  pico.edges();
  EXPECT_TRUE(board.start().ok());
  auto receipt = board.wait(20s);
  EXPECT_TRUE(receipt.ok());
  if (!receipt) return run;
  run.receipt = *receipt;
  const auto edges = pico.edges();
  // Ticks are cycles but for where they begin to count; every program here begins with a word that moves a
  // line.
  const auto first =
      std::find_if(edges.begin(), edges.end(), [](const PinEdge& edge) { return edge.gpio < kOutputs; });
  EXPECT_NE(first, edges.end());
  if (first == edges.end()) return run;
  const std::uint64_t begin = first->cycle;
  const unsigned vsync = gpio_of(board.info(), "vsync");
  for (const PinEdge& edge : edges) {
    const auto tick = static_cast<std::int64_t>(edge.cycle) - static_cast<std::int64_t>(begin);
    if (edge.gpio < kOutputs) run.changes.push_back({static_cast<double>(tick), edge.gpio, edge.level});
    // From the first rising edge on; a pulse that was under way before has no part in the run.
    if (edge.gpio == vsync && (edge.level || !run.vsync.empty())) run.vsync.push_back(tick);
  }
  return run;
}

/// Pulses from before the simulated run's time 0 do not matter to it.
constexpr std::int64_t kFrom = -9'999'999;

Result<Program> nested(const BoardInfo& info) {
  ProgramBuilder program(info);
  program.set("aux0", true).hold(20us);
  program.loop(3).set("aux1", true).hold(4us).set("aux1", false).hold(4us);
  program.loop(2).set("aux2", true).hold(5us);
  program.loop(3).mark(7).pulse("camera_trigger", 6us).hold(7us);
  program.loop(4).pulse("lamp_enable", 4us).hold(4us + 8ns).end_loop();
  program.end_loop().set("aux2", false).hold(10us).end_loop();
  return program.end_loop().set("aux0", false).hold(1us).end();
}

Result<Program> shortest(const BoardInfo& info) {
  ProgramBuilder program(info);
  for (unsigned k = 0; k < 100; ++k)
    program.set("aux3", k % 2 == 0).set("aux4", k % 3 == 0).hold(info.min_dwell);
  return program.set("aux3", false).set("aux4", false).hold(100us).end();
}

Result<Program> waits(const BoardInfo& info) {
  ProgramBuilder program(info);
  program.set("aux5", true).hold(10us).loop(20);
  program.wait_edge("vsync", EdgeKind::rising, 20ms, OnTimeout::abort)
      .mark(1)
      .pulse("camera_trigger", 12us)
      .hold(38us);
  program.wait_edge("vsync", EdgeKind::falling, 20ms, OnTimeout::abort)
      .pulse("camera_trigger_b", 9us)
      .hold(33us);
  return program.end_loop().set("aux5", false).hold(1us).end();
}

/// Eight patterns with brackets of five: what a scan is.
Result<Program> scan(const BoardInfo& info) {
  RigSetup rig = default_rig_setup();
  rig.projector.refresh = 2ms;
  rig.projector.vsync_timeout = 20ms;
  rig.projector.advance_pulse = 50us;
  rig.projector.settle = 100us;
  rig.camera.readout = 150us;
  const std::vector<std::vector<Nanoseconds>> brackets(8, {20us, 80us, 320us, 640us, 1280us});
  SYMRIG_TRY(const CompiledProgram compiled, compile_brackets(rig, info, brackets));
  return compiled.program;
}

const std::vector<GoldenProgram>& goldens() {
  static const std::vector<GoldenProgram> kGoldens{
      {"nested", nested}, {"shortest", shortest}, {"waits", waits, 400'003ns}, {"scan", scan, 2'000'003ns}};
  return kGoldens;
}

class GoldenPrograms : public testing::TestWithParam<GoldenProgram> {};

TEST_P(GoldenPrograms, give_the_same_edges_on_both_boards) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  ASSERT_OK(board.configure({}));
  const BoardInfo& info = board.info();
  const auto program = GetParam().make(info);
  ASSERT_OK(program);
  const auto vsync = static_cast<std::uint8_t>(gpio_of(info, "vsync"));
  if (GetParam().vsync_period.count() > 0)
    ASSERT_OK(pico.bench().pulse(vsync, GetParam().vsync_period, GetParam().vsync_period / 4));
  const GoldenRun real = run_on_pico(pico, board, *program);
  const GoldenRun simulated = golden_run_on_sim(info, *program, real.vsync, kFrom);
  expect_same_run(real, simulated);
  EXPECT_EQ(real.changes, simulated.changes);
  // Marks are dated by stamps of the awaited line, which are up to two ticks off.
  ASSERT_EQ(real.receipt.marks.size(), simulated.receipt.marks.size());
  std::int64_t off = 0;
  for (std::size_t k = 0; k < real.receipt.marks.size(); ++k) {
    EXPECT_EQ(real.receipt.marks[k].id, simulated.receipt.marks[k].id);
    const auto at = static_cast<std::int64_t>(real.receipt.marks[k].tick.count - real.receipt.started.count);
    const auto due =
        static_cast<std::int64_t>(simulated.receipt.marks[k].tick.count - simulated.receipt.started.count);
    off = std::max(off, std::abs(at - due));
  }
  EXPECT_LE(off, 2);
  std::printf("%s: %zu records, %zu edges the same to the tick, %zu marks at most %lld ticks apart\n",
              GetParam().name, program->records(), real.changes.size(), real.receipt.marks.size(),
              static_cast<long long>(off));
}

INSTANTIATE_TEST_SUITE_P(Pico, GoldenPrograms, testing::ValuesIn(goldens()),
                         [](const auto& each) { return std::string(each.param.name); });

TEST(GoldenPrograms, a_wait_that_runs_out_resumes_within_a_millisecond) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  ASSERT_OK(board.configure({}));
  ProgramBuilder builder(board.info());
  builder.set("aux0", true).hold(50us).set("aux0", false).hold(50us);
  builder.wait_edge("vsync", EdgeKind::rising, 2ms, OnTimeout::keep_going);
  const auto program = builder.set("aux1", true).hold(50us).set("aux1", false).hold(1us).end();
  ASSERT_OK(program);
  const GoldenRun real = run_on_pico(pico, board, *program);
  const GoldenRun simulated = golden_run_on_sim(board.info(), *program, {}, kFrom);
  ASSERT_EQ(real.changes.size(), 4U);
  ASSERT_EQ(simulated.changes.size(), 4U);
  const auto later = static_cast<std::int64_t>(real.changes[2].tick - simulated.changes[2].tick);
  EXPECT_GE(later, 0);
  EXPECT_LE(later, 125'000);
  EXPECT_EQ(real.changes[3].tick - real.changes[2].tick,
            simulated.changes[3].tick - simulated.changes[2].tick);
  std::printf("a wait that ran out resumed %.2f us late\n", static_cast<double>(later) * 0.008);
}

// The whole conformance kit on the image that users flash, with the wire that each group of checks asks for.

/// All checks with a wire from aux0 to `input`. skipped: how many may be.
void check_all(const char* input, std::size_t skipped) {
  EmulatedPico pico;
  const BoardInfo info = pico.connect().info();
  const auto from = static_cast<std::uint8_t>(gpio_of(info, "aux0"));
  const auto to = static_cast<std::uint8_t>(gpio_of(info, input));
  ASSERT_OK(pico.bench().jumper(from, to));
  ConformanceOptions options;
  options.jumper = Jumper{"aux0", input};
  options.on_result = [](const CheckResult& result) {
    EXPECT_NE(result.outcome, CheckOutcome::failed) << result.name << ": " << result.detail;
  };
  const auto report = check_conformance(pico.link(), options);
  ASSERT_OK(report);
  EXPECT_EQ(report->count(CheckOutcome::skipped), skipped);
  std::printf("wire to %s: %zu passed, %zu failed, %zu skipped\n", input, report->count(CheckOutcome::passed),
              report->count(CheckOutcome::failed), report->count(CheckOutcome::skipped));
}

TEST(EmulatedPico, passes_the_conformance_kit_with_a_wire_to_a_stamped_input) {
  NEEDS_EMULATION();
  check_all("camera_strobe", 2);  // that input cannot be an interlock
}

TEST(EmulatedPico, passes_the_conformance_kit_with_a_wire_to_the_interlock) {
  NEEDS_EMULATION();
  check_all("interlock", 0);
}

// The production test on the emulated Pico with its plug: every wire, an interlock, and the watchdog starved
// on purpose.

TEST(EmulatedPico, passes_the_production_test_with_its_plug) {
  NEEDS_EMULATION();
  EmulatedPico pico;
  Board board = pico.connect();
  const std::vector<Jumper> plug = default_plug(board.info());
  ASSERT_EQ(plug.size(), 6U);
  for (const Jumper& wire : plug)
    ASSERT_OK(pico.bench().jumper(static_cast<std::uint8_t>(gpio_of(board.info(), wire.output)),
                                  static_cast<std::uint8_t>(gpio_of(board.info(), wire.input))));
  SelfTestOptions options;
  options.pings = 3;
  const auto test = fixture_test(board, plug, options);
  ASSERT_OK(test);
  for (const SelfCheck& check : test->basics.checks) EXPECT_TRUE(check.passed) << check.text;
  ASSERT_EQ(test->wires.size(), 6U);
  for (const WireTest& wire : test->wires) EXPECT_TRUE(wire.passed) << wire.text;
  EXPECT_TRUE(test->crossing.passed) << test->crossing.text;
  EXPECT_TRUE(test->trip.passed) << test->trip.text;
  EXPECT_TRUE(test->watchdog.passed) << test->watchdog.text;
  ASSERT_TRUE(test->watchdog.answered);
  const Nanoseconds answered = board.info().rate.nanoseconds(*test->watchdog.answered);
  EXPECT_GE(answered, 350ms);
  EXPECT_LE(answered, 410ms);
  // The board is as good as new: the self-test objects to a start by the watchdog.
  const auto again = self_test(board, options);
  ASSERT_OK(again);
  EXPECT_TRUE(again->passed());
  std::printf("trip: %s\nwatchdog: %s\n", test->trip.text.c_str(), test->watchdog.text.c_str());
}

}  // namespace
}  // namespace symrig::test::golden_programs_test
