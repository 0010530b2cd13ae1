// SPDX-License-Identifier: Apache-2.0
// Edges, marks and tallies of whole runs, to the tick, against loops written out by recursion and times added
// up.
#include "raw_host.hpp"
#include "unit/protocol/random_program.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::firmware::sequencer_test {
namespace {

using test::RawHost;
using test::Recorder;
using test::Step;

constexpr std::uint32_t kLatency = 20;

/// Drives an input line at given ticks, beginning low: rising, falling, rising, ...
class Toggler final : public board_sim::Peripheral {
 public:
  Toggler(int line, std::vector<std::uint64_t> ticks) : line_(line), ticks_(std::move(ticks)) {}
  void outputs_changed(std::uint64_t, std::uint32_t, board_sim::SimBoard&) override {}
  std::uint64_t next_event() const override {
    return next_ < ticks_.size() ? ticks_[next_] : board_sim::kNever;
  }
  void on_event(std::uint64_t, board_sim::SimBoard& board) override {
    board.set_input(line_, next_++ % 2 == 0);
  }
  const std::vector<std::uint64_t>& ticks() const { return ticks_; }

 private:
  int line_;
  std::vector<std::uint64_t> ticks_;
  std::size_t next_ = 0;
};

struct ExpectedMark {
  std::uint32_t id;
  std::uint64_t tick;
};

/// What a run must look like, worked out from the tree and the input's edges alone.
struct Expectation {
  std::vector<Recorder::Change> changes;
  std::vector<ExpectedMark> marks;
  std::uint64_t end = 0;
  std::uint64_t steps = 0;
};

bool matches(protocol::WaitFor wanted, std::size_t edge) {
  const bool rising = edge % 2 == 0;
  return wanted == protocol::WaitFor::both || (wanted == protocol::WaitFor::rising) == rising;
}

std::uint64_t wait_ends(const Step& wait, std::uint64_t begin, const std::vector<std::uint64_t>& edges) {
  for (std::size_t k = 0; k < edges.size(); ++k)
    if (edges[k] >= begin && edges[k] < begin + wait.ticks && matches(wait.edge, k)) return edges[k];
  return begin + wait.ticks;
}

Expectation expect_run(const test::ProgramTree& tree, std::uint64_t start,
                       const std::vector<std::uint64_t>& edges) {
  Expectation expected;
  std::uint64_t tick = start;
  std::uint32_t levels = 0;
  const auto put = [&](std::uint32_t word) {
    if (word != levels) expected.changes.push_back({tick, word});
    levels = word;
  };
  for (const Step& step : test::expand(tree)) {
    if (step.kind == Step::Kind::mark) {
      expected.marks.push_back({step.value, tick});
    } else if (step.kind == Step::Kind::wait) {
      tick = wait_ends(step, tick, edges) + kLatency;
    } else {
      put(step.value);
      tick += step.ticks;
      ++expected.steps;
    }
  }
  put(tree.final_levels);
  expected.end = tick;
  return expected;
}

std::vector<std::uint64_t> random_edges(test::Random& random) {
  std::vector<std::uint64_t> ticks;
  ticks.reserve(400);
  std::uint64_t tick = 0;
  for (int k = 0; k < 400; ++k) ticks.push_back(tick += random.range(1, 200));
  return ticks;
}

struct Bench {
  board_sim::SimBoard board;
  Recorder recorder;
  Toggler toggler;
  RawHost host{board};

  Bench(board_sim::SimBoardConfig config, std::vector<std::uint64_t> edges)
      : board(std::move(config)), toggler(3, std::move(edges)) {
    board.attach(recorder);
    board.attach(toggler);
  }
};

board_sim::SimBoardConfig small_board(std::uint64_t start_tick, std::uint32_t segments) {
  board_sim::SimBoardConfig config;
  config.start_tick = start_tick;
  config.engine_segments = segments;
  config.wait_latency = kLatency;
  return config;
}

void expect_marks(const RawHost& host, const Expectation& expected) {
  std::vector<symrig_wire_StepMark> marks;
  for (const symrig_wire_Event& event : host.events)
    if (event.which_body == symrig_wire_Event_step_mark_tag) marks.push_back(event.body.step_mark);
  ASSERT_EQ(marks.size(), expected.marks.size());
  for (std::size_t k = 0; k < marks.size(); ++k) {
    EXPECT_EQ(marks[k].id, expected.marks[k].id);
    EXPECT_EQ(marks[k].tick, expected.marks[k].tick);
    EXPECT_EQ(marks[k].ordinal, k);
  }
}

/// Runs a random tree and compares everything.
void run_and_compare(std::uint64_t seed, unsigned wait_percent, std::uint64_t start_tick) {
  test::Random random(seed);
  test::TreeOptions options;
  options.wait_percent = wait_percent;
  options.most_rounds = 4;
  test::ProgramTree tree = test::random_tree(random, options);
  tree.final_levels = static_cast<std::uint32_t>(random.range(0, 7));
  std::vector<std::uint64_t> edges = random_edges(random);
  for (std::uint64_t& tick : edges) tick += start_tick;
  Bench bench(small_board(start_tick, static_cast<std::uint32_t>(random.range(2, 9))), edges);
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  const auto bytes = test::pack(tree);
  ASSERT_EQ(bench.host.upload(bytes), 0U) << "seed " << seed;
  ASSERT_EQ(bench.host.arm(), 0U);
  const std::uint64_t start = start_tick + random.range(0, 1000);
  bench.recorder.changes.clear();
  ASSERT_EQ(bench.host.start_at(start), 0U);
  ASSERT_TRUE(bench.host.run_out(std::uint64_t{1} << 32U)) << "seed " << seed;
  const Expectation expected = expect_run(tree, start, edges);
  EXPECT_EQ(bench.recorder.changes, expected.changes) << "seed " << seed;
  expect_marks(bench.host, expected);
  const symrig_wire_RunDone done = bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done;
  EXPECT_EQ(done.end, symrig_wire_RunEnd_RUN_END_COMPLETED);
  EXPECT_EQ(done.duration, expected.end - start) << "seed " << seed;
  EXPECT_EQ(done.tick, expected.end);
  EXPECT_EQ(done.steps, expected.steps) << "seed " << seed;
  EXPECT_EQ(done.underruns, 0U);
  EXPECT_EQ(done.late, 0U);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_DONE);
}

TEST(Sequencer, random_loops_are_exact_to_the_tick) {
  for (std::uint64_t seed = 0; seed < 300 && !testing::Test::HasFailure(); ++seed)
    run_and_compare(seed, 0, 0);
}

TEST(Sequencer, random_waits_are_exact_to_the_tick) {
  for (std::uint64_t seed = 1000; seed < 1300 && !testing::Test::HasFailure(); ++seed)
    run_and_compare(seed, 30, 0);
}

TEST(Sequencer, thirty_two_bits_of_ticks_may_run_over_in_mid_run) {
  for (std::uint64_t seed = 2000; seed < 2050 && !testing::Test::HasFailure(); ++seed)
    run_and_compare(seed, 20, (std::uint64_t{1} << 32U) - 1200);
}

TEST(Sequencer, a_program_may_begin_with_a_wait_and_end_with_one) {
  Bench bench(small_board(0, 4), {500, 600, 5000});
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  test::ProgramTree tree;
  Step wait;
  wait.kind = Step::Kind::wait;
  wait.value = 3;
  wait.ticks = 10'000;
  tree.steps = {wait, wait};
  tree.final_levels = 5;
  ASSERT_EQ(bench.host.upload(test::pack(tree)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  bench.recorder.changes.clear();
  ASSERT_EQ(bench.host.start_at(100), 0U);
  ASSERT_TRUE(bench.host.run_out(100'000));
  const std::vector<Recorder::Change> expected{{5000 + kLatency, 5}};
  EXPECT_EQ(bench.recorder.changes, expected);
}

TEST(Sequencer, a_wait_that_aborts_ends_the_run_and_makes_safe) {
  Bench bench(small_board(0, 4), {});
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  test::ProgramTree tree;
  Step word;
  word.value = 7;
  word.ticks = 50;
  Step wait;
  wait.kind = Step::Kind::wait;
  wait.value = 3;
  wait.ticks = 100;
  wait.abort = true;
  tree.steps = {word, wait, word};
  ASSERT_EQ(bench.host.upload(test::pack(tree)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  bench.recorder.changes.clear();
  ASSERT_EQ(bench.host.start_at(1000), 0U);
  ASSERT_TRUE(bench.host.run_out(100'000));
  const symrig_wire_RunDone done = bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done;
  EXPECT_EQ(done.end, symrig_wire_RunEnd_RUN_END_WAIT_TIMEOUT);
  EXPECT_EQ(done.arg, 1U);
  EXPECT_EQ(done.duration, 150U);
  const std::vector<Recorder::Change> expected{{1000, 7}, {1150, 0}};
  EXPECT_EQ(bench.recorder.changes, expected);
  EXPECT_EQ(bench.host.state(), symrig_wire_State_STATE_LOADED);
}

TEST(Sequencer, a_stalled_processor_is_an_underrun_and_makes_safe) {
  Bench bench(small_board(0, 4), {});
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  test::ProgramTree tree;
  for (std::uint32_t k = 0; k < 20; ++k) {
    Step word;
    word.value = 1 + k % 7;
    word.ticks = 100;
    tree.steps.push_back(word);
  }
  ASSERT_EQ(bench.host.upload(test::pack(tree)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  ASSERT_EQ(bench.host.start_at(1000), 0U);
  bench.board.stall_firmware_until(1000 + 1500);  // four words are queued: the fifth is due at 1400
  ASSERT_TRUE(bench.host.run_out(100'000));
  const symrig_wire_RunDone done = bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done;
  EXPECT_EQ(done.end, symrig_wire_RunEnd_RUN_END_FAULT);
  EXPECT_EQ(done.underruns, 1U);
  EXPECT_EQ(done.steps, 4U);
  const symrig_wire_StatusReply status = bench.host.status();
  EXPECT_EQ(status.state, symrig_wire_State_STATE_FAULT);
  EXPECT_EQ(status.fault.code, symrig_wire_FaultCode_FAULT_UNDERRUN);
  EXPECT_EQ(status.levels & 7U, 0U);
}

TEST(Sequencer, an_abort_stops_marks_and_edges_at_once) {
  Bench bench(small_board(0, 64), {});
  bench.host.hello();
  ASSERT_EQ(bench.host.configure(test::plain_config()), 0U);
  test::ProgramTree tree;
  Step mark;
  mark.kind = Step::Kind::mark;
  Step word;
  word.value = 3;
  word.ticks = 100;
  Step dark = word;
  dark.value = 0;
  for (int k = 0; k < 10; ++k) tree.steps.insert(tree.steps.end(), {mark, word, dark});
  ASSERT_EQ(bench.host.upload(test::pack(tree)), 0U);
  ASSERT_EQ(bench.host.arm(), 0U);
  bench.recorder.changes.clear();
  ASSERT_EQ(bench.host.start_at(1000), 0U);
  bench.board.advance_to(1450);  // in the third pulse
  bench.host.abort();
  const std::vector<Recorder::Change> expected{{1000, 3}, {1100, 0}, {1200, 3},
                                               {1300, 0}, {1400, 3}, {1450, 0}};
  EXPECT_EQ(bench.recorder.changes, expected);
  bench.board.advance_to(100'000);
  bench.host.listen();
  EXPECT_EQ(bench.recorder.changes, expected);
  const auto marks = std::count_if(bench.host.events.begin(), bench.host.events.end(), [](const auto& event) {
    return event.which_body == symrig_wire_Event_step_mark_tag;
  });
  EXPECT_EQ(marks, 3);
  const symrig_wire_RunDone done = bench.host.last(symrig_wire_Event_run_done_tag)->body.run_done;
  EXPECT_EQ(done.end, symrig_wire_RunEnd_RUN_END_ABORTED);
  EXPECT_EQ(done.duration, 450U);
  EXPECT_EQ(done.steps, 5U);
}

}  // namespace
}  // namespace symrig::firmware::sequencer_test
