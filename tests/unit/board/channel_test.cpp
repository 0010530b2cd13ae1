// SPDX-License-Identifier: Apache-2.0
// Runs over channels that lose, repeat, swap, cut and damage frames: whatever comes through, the run is that
// of a clean channel. A million frames are sent; with SYMRIG_LONG set, thirty million.
#include "bench.hpp"
#include "faulty_link.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::channel_test {
namespace {

using namespace std::chrono_literals;

/// Every change of the outputs.
class Scribe final : public board_sim::Peripheral {
 public:
  std::vector<std::pair<std::uint64_t, std::uint32_t>> changes;

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard&) override {
    changes.emplace_back(tick, levels & 7U);
  }
  std::uint64_t next_event() const override { return board_sim::kNever; }
  void on_event(std::uint64_t, board_sim::SimBoard&) override {}
};

/// More chunks than the window holds, marks and captured edges all along.
Result<Program> long_program(const BoardInfo& info) {
  ProgramBuilder program(info);
  for (int k = 0; k < 180; ++k) {
    program.mark(static_cast<std::uint32_t>(k))
        .set("camera_trigger", true)
        .hold(Ticks{2000U + static_cast<unsigned>(k)});
    program.set("camera_trigger", false).hold(3us);
  }
  program.loop(40).mark(1000).pulse("projector_trigger", 5us).hold(5us).end_loop();
  return program.end();
}

struct Trace {
  std::vector<StepMark> marks;      // ticks from the start
  std::vector<CapturedEdge> edges;  //
  std::vector<std::pair<std::uint64_t, std::uint32_t>> pins;
  std::uint64_t steps = 0;
  Ticks actual;

  bool operator==(const Trace&) const = default;
};

Trace trace_of(const Receipt& receipt, const Scribe& scribe) {
  Trace trace{receipt.marks, receipt.edges, {}, receipt.steps, receipt.actual};
  for (StepMark& mark : trace.marks) mark.tick = mark.tick - receipt.started;
  for (CapturedEdge& edge : trace.edges) edge.tick = edge.tick - receipt.started;
  for (const auto& [tick, levels] : scribe.changes)
    if (tick >= receipt.started.count) trace.pins.emplace_back(tick - receipt.started.count, levels);
  return trace;
}

struct Outcome {
  Trace first, second;
  std::uint64_t frames = 0;
  std::uint64_t spoiled = 0;
};

/// Two runs of one program in one session.
void run_over(const test::Faults& faults, Outcome& outcome) {
  board_sim::SimBoard sim;
  Scribe scribe;
  sim.attach(scribe);
  auto link = std::make_unique<test::FaultyLink>(make_sim_link(sim), faults);
  const test::FaultyLink& channel = *link;
  BoardOptions options;
  options.attempts = 60;
  options.reply_timeout = 5ms;
  auto board = Board::connect(std::move(link), options);
  ASSERT_OK(board);
  const std::vector<LineConfig> lines{{.line = "camera_trigger", .capture = true},
                                      {.line = "projector_trigger", .capture = true}};
  ASSERT_OK(board->configure(lines));
  const auto program = long_program(board->info());
  ASSERT_OK(program);
  for (Trace* trace : {&outcome.first, &outcome.second}) {
    scribe.changes.clear();
    const auto receipt = board->run(*program, 60s);
    ASSERT_OK(receipt);
    EXPECT_TRUE(receipt->clean());
    EXPECT_EQ(receipt->program_hash, program->hash());
    *trace = trace_of(*receipt, scribe);
  }
  outcome.frames = channel.frames();
  outcome.spoiled = channel.spoiled();
}

TEST(Channel, whatever_comes_through_is_the_run_of_a_clean_one) {
  const std::uint64_t wanted = std::getenv("SYMRIG_LONG") != nullptr ? 30'000'000 : 1'000'000;
  Outcome clean;
  ASSERT_NO_FATAL_FAILURE(run_over({}, clean));
  ASSERT_EQ(clean.first.marks.size(), 220U);
  ASSERT_EQ(clean.first.edges.size(), 440U);
  ASSERT_EQ(clean.first, clean.second);
  symrig::test::Random random(4);
  std::uint64_t frames = 0;
  std::uint64_t spoiled = 0;
  for (std::uint64_t seed = 1; frames < wanted; ++seed) {
    const auto some = [&random](unsigned most) { return static_cast<unsigned>(random.range(0, most)); };
    Outcome outcome;
    ASSERT_NO_FATAL_FAILURE(
        run_over({seed, some(12), some(12), some(12), some(6), some(12), some(6)}, outcome))
        << "seed " << seed;
    ASSERT_EQ(outcome.first, clean.first) << "seed " << seed;
    ASSERT_EQ(outcome.second, clean.first) << "seed " << seed;
    frames += outcome.frames;
    spoiled += outcome.spoiled;
  }
  EXPECT_GT(spoiled, frames / 10);
  RecordProperty("frames", std::to_string(frames));
  RecordProperty("spoiled", std::to_string(spoiled));
}

/// A board that cannot keep its events names every one that it lost.
TEST(Channel, nothing_is_lost_without_being_named) {
  for (const unsigned rounds : {900U, 1100U, 3000U}) {
    board_sim::SimBoard sim;
    auto board = Board::connect(make_sim_link(sim));
    ASSERT_OK(board);
    ASSERT_OK(board->configure({}));
    ProgramBuilder builder(board->info());
    builder.loop(rounds).mark(7).hold(10us).end_loop();
    const auto program = builder.end();
    ASSERT_OK(program);
    ASSERT_OK(board->upload(*program));
    ASSERT_OK(board->arm());
    ASSERT_OK(board->start());
    sim.advance_to(sim.now() + rounds * 1250ULL + 125'000);  // the host does not listen meanwhile
    const auto receipt = board->wait(10s);
    ASSERT_OK(receipt);
    EXPECT_EQ(receipt->marks.size() + receipt->events_lost, rounds);
    EXPECT_EQ(receipt->events_lost > 0, rounds > 1020);  // 1024 less the reserve for what is important
    for (std::size_t k = 1; k < receipt->marks.size(); ++k)
      EXPECT_GT(receipt->marks[k].ordinal, receipt->marks[k - 1].ordinal);
  }
}

}  // namespace
}  // namespace symrig::channel_test
