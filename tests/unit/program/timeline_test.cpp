// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/timeline.hpp"

#include "symrig/run/compare.hpp"
#include "workshop.hpp"

namespace symrig::timeline_test {
namespace {

using namespace std::chrono_literals;

Timeline expanded(const Program& program, const TimelineOptions& options = {}) {
  const auto timeline = expand(program, test::board(), options);
  EXPECT_TRUE(timeline.ok()) << (timeline.ok() ? "" : timeline.error().line());
  return timeline.ok() ? *timeline : Timeline{};
}

Program loops(std::uint64_t outer, std::uint64_t inner) {
  ProgramBuilder builder(test::board());
  builder.loop(outer).mark(7).loop(inner).pulse("lamp_enable", 80ns).hold(Ticks{20}).end_loop().end_loop();
  return *builder.end();
}

TEST(Timeline, loops_are_unrolled) {
  const Timeline timeline = expanded(loops(2, 3), {.start = Ticks{1000}});
  ASSERT_EQ(timeline.edges.size(), 12U);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_EQ(timeline.edges[2 * k].tick, Ticks{1000 + 30 * k});
    EXPECT_EQ(timeline.edges[2 * k + 1].tick, Ticks{1010 + 30 * k});
    EXPECT_TRUE(timeline.edges[2 * k].level);
    EXPECT_EQ(timeline.edges[2 * k].line, 2);
  }
  EXPECT_EQ(timeline.marks, (std::vector<StepMark>{{7, 0, Ticks{1000}}, {7, 1, Ticks{1090}}}));
  EXPECT_EQ(timeline.end, Ticks{1180});
  EXPECT_EQ(timeline.steps, 12U);
  EXPECT_TRUE(timeline.complete);
}

TEST(Timeline, a_bound_cuts_endless_programs_off) {
  const Timeline timeline = expanded(loops(kMaxRounds, kMaxRounds), {.max_edges = 1001});
  EXPECT_EQ(timeline.edges.size(), 1001U);
  EXPECT_TRUE(timeline.cut_off);
  EXPECT_FALSE(timeline.complete);
  EXPECT_EQ(timeline.edges[1000].tick, Ticks{15'000});
}

// A loop that makes no edges does not run for ever either: the number of looks is bounded.
TEST(Timeline, loops_without_edges_end_too) {
  ProgramBuilder builder(test::board());
  const Program program = *builder.loop(kMaxRounds).hold(1us).end_loop().end();
  const Timeline timeline = expanded(program, {.max_edges = 1000});
  EXPECT_TRUE(timeline.cut_off);
  EXPECT_TRUE(timeline.edges.empty());
}

TEST(Timeline, at_most_so_many_rounds_of_each_loop) {
  EXPECT_EQ(expanded(loops(1000, 1000), {.max_rounds = 2}).edges.size(), 8U);
}

Program waits(OnTimeout action) {
  ProgramBuilder builder(test::board());
  builder.set("lamp_enable", true).hold(1us).wait_edge("vsync", EdgeKind::rising, 10us, action);
  return *builder.mark(1).set("lamp_enable", false).hold(1us).end();
}

TEST(Timeline, waits_end_with_the_edge_and_the_boards_latency) {
  const auto come_at = [](std::uint64_t tick) {
    return [tick](const PlannedWait& wait) {
      EXPECT_EQ(wait.begin, Ticks{125});
      EXPECT_EQ(wait.timeout, Ticks{1250});
      EXPECT_EQ(wait.line, 3);
      return std::optional<Ticks>(Ticks{tick});
    };
  };
  TimelineOptions options;
  options.edge_at = come_at(700);
  EXPECT_EQ(expanded(waits(OnTimeout::abort), options).marks.at(0).tick, Ticks{825});
  options.edge_at = come_at(1375);  // the last tick that counts
  EXPECT_EQ(expanded(waits(OnTimeout::abort), options).marks.at(0).tick, Ticks{1500});
  options.edge_at = come_at(1376);
  const Timeline late = expanded(waits(OnTimeout::keep_going), options);
  EXPECT_EQ(late.marks.at(0).tick, Ticks{1500});
  EXPECT_TRUE(late.waits.at(0).timed_out);
  const Timeline ended = expanded(waits(OnTimeout::abort), options);
  EXPECT_TRUE(ended.marks.empty());
  EXPECT_FALSE(ended.complete);
  EXPECT_EQ(ended.end, Ticks{1375});
}

TEST(Timeline, lines_that_begin_high_make_no_edge_until_they_fall) {
  ProgramBuilder builder(test::board());
  builder.set("lamp_enable", true).hold(1us).set("lamp_enable", false).hold(1us);
  const Timeline timeline = expanded(*builder.end(), {.initial_levels = 0b100});
  ASSERT_EQ(timeline.edges.size(), 1U);
  EXPECT_EQ(timeline.edges[0], (PlannedEdge{2, false, Ticks{125}, 1}));
}

TEST(Timeline, broken_records_are_refused) {
  const auto of = [](std::vector<std::uint8_t> bytes) {
    return expand(*Program::from_bytes(std::move(bytes)), test::board());
  };
  EXPECT_FALSE(of({0, 0, 0, 0, 0, 0, 0, 0}).ok());
  EXPECT_FALSE(of({0, 0, 0, 0x30, 0, 0, 0, 0}).ok());  // end_loop without loop
  EXPECT_FALSE(of({0, 1, 0, 0x40, 1, 0, 0, 0}).ok());  // a wait with a bit too many
}

Timeline plan_of(std::vector<PlannedEdge> edges) {
  Timeline plan;
  plan.edges = std::move(edges);
  return plan;
}

TEST(Compare, equal_edges_are_exact) {
  const Timeline plan = plan_of({{1, true, Ticks{10}, 0}, {2, true, Ticks{12}, 0}, {1, false, Ticks{20}, 1}});
  const std::vector<CapturedEdge> edges{{1, true, Ticks{10}}, {2, true, Ticks{12}}, {1, false, Ticks{20}}};
  const Comparison all = compare(plan, edges, 0b110);
  EXPECT_TRUE(all.exact());
  EXPECT_EQ(all.pairs.size(), 3U);
}

TEST(Compare, tells_late_missing_and_unplanned_edges_apart) {
  const Timeline plan = plan_of(
      {{1, true, Ticks{10}, 0}, {1, false, Ticks{20}, 1}, {1, true, Ticks{30}, 2}, {1, false, Ticks{40}, 3}});
  const std::vector<CapturedEdge> late{
      {1, true, Ticks{11}}, {1, false, Ticks{20}}, {1, true, Ticks{33}}, {1, false, Ticks{40}}};
  const Comparison all = compare(plan, late, 0b10);
  EXPECT_FALSE(all.exact());
  EXPECT_EQ(all.largest, 3);
  EXPECT_EQ(all.mean, 1.0);
  const Comparison cut = compare(plan, std::span(late).first(2), 0b10);
  EXPECT_EQ(cut.pairs.size(), 2U);
  EXPECT_EQ(cut.missing.size(), 2U);
  // An edge that came from elsewhere does not shift those after it.
  const std::vector<CapturedEdge> more{{1, false, Ticks{5}},
                                       {1, true, Ticks{10}},
                                       {1, false, Ticks{20}},
                                       {1, true, Ticks{30}},
                                       {1, false, Ticks{40}}};
  const Comparison extra = compare(plan, more, 0b10);
  EXPECT_EQ(extra.unplanned.size(), 1U);
  EXPECT_EQ(extra.pairs.size(), 4U);
  EXPECT_EQ(extra.largest, 0);
}

TEST(Compare, passes_over_lines_that_nobody_watched) {
  const Timeline plan = plan_of({{1, true, Ticks{10}, 0}, {2, true, Ticks{12}, 0}});
  const std::vector<CapturedEdge> edges{{1, true, Ticks{10}}, {3, true, Ticks{12}}};
  EXPECT_TRUE(compare(plan, edges, 0b010).exact());
  EXPECT_EQ(compare(plan, edges, 0b110).missing.size(), 1U);
}

}  // namespace
}  // namespace symrig::timeline_test
