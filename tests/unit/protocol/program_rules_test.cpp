// SPDX-License-Identifier: Apache-2.0
#include "random_program.hpp"
#include "symrig/protocol/check_program.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace symrig::protocol::program_rules_test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using test::Step;

constexpr std::uint32_t kMinDwell = 5;
constexpr std::uint32_t kLatency = 7;

/// Lines 0..2 outputs, 3 and 4 inputs, no limits.
BoardConfig plain_config() {
  BoardConfig config;
  for (unsigned k = 0; k < 5; ++k) {
    config.lines[k].configured = true;
    config.lines[k].output = k < 3;
  }
  return config;
}

ProgramRules rules_of(const BoardConfig& config) {
  return {&config, kMinDwell, 0xFFFFFFFF, kLatency, 1U << 20U, kMaxLoopDepth};
}

struct Verdict {
  bool sound = false;
  ProgramTiming timing;
  std::vector<Violation> found;

  bool broke(Rule rule) const {
    return std::any_of(found.begin(), found.end(), [rule](const Violation& v) { return v.rule == rule; });
  }
};

Verdict judge(const Bytes& program, const BoardConfig& config) {
  Verdict verdict;
  verdict.sound = check_program({{program.data(), program.size()}}, rules_of(config), verdict.timing,
                                [&](const Violation& violation) {
                                  verdict.found.push_back(violation);
                                  return true;
                                });
  return verdict;
}

Verdict judge(const std::vector<Record>& records, const BoardConfig& config) {
  Bytes bytes;
  for (const Record& record : records) test::pack(record, bytes);
  return judge(bytes, config);
}

constexpr Record word(std::uint32_t levels, std::uint32_t ticks) {
  return make_record(Op::set_word, levels, ticks);
}
constexpr Record loop(std::uint32_t rounds) {
  return make_loop(rounds);
}
constexpr Record kEndLoop = make_record(Op::end_loop, 0, 0);
constexpr Record kEnd = make_record(Op::end, 0, 0);
constexpr Record kMark = make_record(Op::mark, 1, 0);

/// What the limits allow, found by playing the program out tick by tick in two extreme ways: a pulse is at
/// its longest and a rest at its shortest.
struct Oracle {
  bool within_limits = true;
  std::uint64_t shortest = 0;
  std::uint64_t longest = 0;
  std::uint64_t steps = 0;
  std::uint64_t marks = 0;
};

struct OracleLine {
  bool on = false;
  bool rested = true;
  std::uint64_t pulse = 0;
  std::uint64_t rest = 0;
};

void play(OracleLine& line, const LineConfig& limits, bool on, std::uint64_t shortest, std::uint64_t longest,
          Oracle& oracle) {
  if (on && !line.on) {
    // d · (pulse + rest) >= pulse, d in thousandths
    const std::uint64_t duty = limits.max_duty_permille == 0 ? 1000 : limits.max_duty_permille;
    const bool early = line.rest < limits.min_off || duty * (line.pulse + line.rest) < 1000 * line.pulse;
    if (!line.rested && early) oracle.within_limits = false;
    line.pulse = 0;
  }
  if (!on && line.on) {
    line.rest = 0;
    line.rested = false;
  }
  line.on = on;
  (on ? line.pulse : line.rest) += on ? longest : shortest;
  if (on && limits.max_on != 0 && line.pulse > limits.max_on) oracle.within_limits = false;
}

Oracle play_out(const test::ProgramTree& tree, const BoardConfig& config) {
  Oracle oracle;
  OracleLine lines[3];
  std::uint32_t levels = config.safe_levels();
  for (const Step& step : test::expand(tree)) {
    if (step.kind == Step::Kind::mark) {
      ++oracle.marks;
      continue;
    }
    const bool waits = step.kind == Step::Kind::wait;
    if (!waits) {
      levels = step.value;
      ++oracle.steps;
    }
    const std::uint64_t shortest = waits ? kLatency : step.ticks;
    const std::uint64_t longest = waits ? std::uint64_t{step.ticks} + kLatency : step.ticks;
    oracle.shortest += shortest;
    oracle.longest += longest;
    for (unsigned k = 0; k < 3; ++k)
      play(lines[k], config.lines[k], (((levels >> k) & 1U) != 0) != config.lines[k].safe_level, shortest,
           longest, oracle);
  }
  return oracle;
}

BoardConfig random_limits(test::Random& random) {
  BoardConfig config = plain_config();
  for (unsigned k = 0; k < 3; ++k) {
    LineConfig& line = config.lines[k];
    line.safe_level = random.chance(30);
    if (random.chance(60)) line.max_on = random.range(20, 3000);
    if (random.chance(30)) line.min_off = random.range(1, 60);
    if (random.chance(30)) line.max_duty_permille = static_cast<std::uint16_t>(random.range(200, 1000));
  }
  return config;
}

TEST(ProgramRules, loops_gone_through_twice_judge_as_loops_played_out) {
  int sound = 0;
  int unsound = 0;
  const bool ok = rc::check([&](std::uint64_t seed) {
    test::Random random(seed);
    test::TreeOptions options;
    options.wait_percent = random.chance(50) ? 20 : 0;
    options.levels_mask = random.chance(50) ? 1 : 7;
    test::ProgramTree tree = test::random_tree(random, options);
    const BoardConfig config = random_limits(random);
    tree.final_levels = config.safe_levels();
    const Oracle oracle = play_out(tree, config);
    const Verdict verdict = judge(test::pack(tree), config);
    RC_ASSERT(verdict.sound == oracle.within_limits);
    (verdict.sound ? sound : unsound) += 1;
    if (!verdict.sound) return;
    RC_ASSERT(verdict.timing.min == oracle.shortest);
    RC_ASSERT(verdict.timing.max == oracle.longest);
    RC_ASSERT(verdict.timing.steps == oracle.steps);
    RC_ASSERT(verdict.timing.marks == oracle.marks);
  });
  EXPECT_TRUE(ok);
  EXPECT_GT(sound, 10);  // both verdicts were met
  EXPECT_GT(unsound, 10);
}

TEST(ProgramRules, many_seeds_of_the_same) {
  for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
    test::Random random(seed);
    test::TreeOptions options;
    options.wait_percent = 10;
    options.levels_mask = 1;
    test::ProgramTree tree = test::random_tree(random, options);
    const BoardConfig config = random_limits(random);
    tree.final_levels = config.safe_levels();
    ASSERT_EQ(judge(test::pack(tree), config).sound, play_out(tree, config).within_limits) << "seed " << seed;
  }
}

TEST(ProgramRules, work_does_not_grow_with_rounds) {
  // 2^28-1 rounds, four deep: played out this would take longer than the universe has.
  const std::vector<Record> records{loop(kMaxArg), loop(kMaxArg), loop(kMaxArg), loop(kMaxArg),
                                    word(1, 5),    word(0, 5),    kEndLoop,      kEndLoop,
                                    kEndLoop,      kEndLoop,      kEnd};
  const Verdict verdict = judge(records, plain_config());
  EXPECT_FALSE(verdict.sound);
  EXPECT_TRUE(verdict.broke(Rule::too_long));
}

TEST(ProgramRules, a_line_held_on_through_a_loop_adds_up) {
  BoardConfig config = plain_config();
  config.lines[0].max_on = 1000;
  EXPECT_TRUE(judge(std::vector{loop(10), word(1, 100), kEndLoop, kEnd}, config).sound);
  const Verdict verdict = judge(std::vector{loop(11), word(1, 100), kEndLoop, kEnd}, config);
  ASSERT_TRUE(verdict.broke(Rule::max_on));
  EXPECT_EQ(verdict.found[0].actual, 1100U);
  EXPECT_EQ(verdict.found[0].limit, 1000U);
  EXPECT_EQ(verdict.found[0].line, 0U);
}

TEST(ProgramRules, a_rest_across_the_seam_of_a_loop_is_judged) {
  BoardConfig config = plain_config();
  config.lines[0].min_off = 30;
  EXPECT_TRUE(
      judge(std::vector{loop(2), word(0, 10), word(1, 10), word(0, 20), kEndLoop, kEnd}, config).sound);
  EXPECT_TRUE(judge(std::vector{loop(2), word(0, 10), word(1, 10), word(0, 19), kEndLoop, kEnd}, config)
                  .broke(Rule::min_off));
  EXPECT_TRUE(
      judge(std::vector{loop(1), word(0, 10), word(1, 10), word(0, 19), kEndLoop, kEnd}, config).sound);
}

TEST(ProgramRules, duty_asks_for_a_rest_in_proportion) {
  BoardConfig config = plain_config();
  config.lines[0].max_duty_permille = 250;  // a pulse of 100 asks for 300 of rest
  EXPECT_TRUE(judge(std::vector{word(1, 100), word(0, 300), word(1, 5), kEnd}, config).sound);
  const Verdict verdict = judge(std::vector{word(1, 100), word(0, 299), word(1, 5), kEnd}, config);
  ASSERT_TRUE(verdict.broke(Rule::duty));
  EXPECT_EQ(verdict.found[0].actual, 299U);
  EXPECT_EQ(verdict.found[0].limit, 300U);
}

TEST(ProgramRules, a_limited_line_may_not_be_left_on) {
  BoardConfig config = plain_config();
  config.lines[2].max_on = 1000;
  EXPECT_TRUE(judge(std::vector{word(0, 10), make_record(Op::end, 4, 0)}, config).broke(Rule::max_on));
  EXPECT_TRUE(judge(std::vector{word(0, 10), make_record(Op::end, 3, 0)}, config).sound);
}

TEST(ProgramRules, a_wait_may_run_out_while_the_lamp_is_on) {
  BoardConfig config = plain_config();
  config.lines[2].max_on = 100;
  const auto with_timeout = [&](std::uint32_t timeout) {
    return judge(std::vector{word(4, 10), make_wait({3, WaitFor::rising, false}, timeout), word(0, 10), kEnd},
                 config);
  };
  EXPECT_TRUE(with_timeout(100 - 10 - kLatency).sound);
  EXPECT_TRUE(with_timeout(100 - 10 - kLatency + 1).broke(Rule::max_on));
}

TEST(ProgramRules, each_structural_rule) {
  const BoardConfig config = plain_config();
  const auto broke = [&](const std::vector<Record>& records, Rule rule) {
    const Verdict verdict = judge(records, config);
    return !verdict.sound && verdict.broke(rule);
  };
  EXPECT_TRUE(broke({}, Rule::length));
  EXPECT_TRUE(judge(Bytes(12, 0), config).broke(Rule::length));
  EXPECT_TRUE(broke({{0, 0, 0}, kEnd}, Rule::bad_op));
  EXPECT_TRUE(broke({{7, 0, 0}, kEnd}, Rule::bad_op));
  EXPECT_TRUE(broke({{15, 0, 0}, kEnd}, Rule::bad_op));
  EXPECT_TRUE(broke({make_record(Op::mark, 1, 1), kEnd}, Rule::bad_arg));
  EXPECT_TRUE(broke({make_record(Op::wait_edge, 3U | (3U << 5U), 10), kEnd}, Rule::bad_arg));
  EXPECT_TRUE(broke({make_record(Op::wait_edge, 3U | 256U, 10), kEnd}, Rule::bad_arg));
  EXPECT_TRUE(broke({make_record(Op::end, 0, 1)}, Rule::bad_arg));
  EXPECT_TRUE(broke({word(1, kMinDwell - 1), kEnd}, Rule::min_dwell));
  EXPECT_TRUE(broke({make_wait({3, WaitFor::both, true}, 0), kEnd}, Rule::max_dwell));
  EXPECT_TRUE(broke({word(8, 10), kEnd}, Rule::not_an_output));
  EXPECT_TRUE(broke({word(1U << 20U, 10), kEnd}, Rule::not_an_output));
  EXPECT_TRUE(broke({make_record(Op::end, 16, 0)}, Rule::not_an_output));
  EXPECT_TRUE(broke({make_wait({0, WaitFor::both, true}, 9), kEnd}, Rule::not_an_input));
  EXPECT_TRUE(broke({make_wait({31, WaitFor::both, true}, 9), kEnd}, Rule::not_an_input));
  EXPECT_TRUE(broke({loop(2), loop(2), loop(2), loop(2), loop(2), word(1, 5), kEnd}, Rule::loop_depth));
  EXPECT_TRUE(broke({loop(2), word(1, 5), kEnd}, Rule::loop_balance));
  EXPECT_TRUE(broke({word(1, 5), kEndLoop, kEnd}, Rule::loop_balance));
  EXPECT_TRUE(broke({loop(0), word(1, 5), kEndLoop, kEnd}, Rule::loop_rounds));
  EXPECT_TRUE(broke({loop(2), kMark, kEndLoop, kEnd}, Rule::idle_loop));
  EXPECT_TRUE(broke({word(1, 5), loop(2), kEndLoop, kEnd}, Rule::idle_loop));
  EXPECT_TRUE(broke(std::vector<Record>(kMaxMarksInARow + 1, kMark), Rule::mark_crowd));
  EXPECT_TRUE(broke({word(1, 5)}, Rule::no_end));
  EXPECT_TRUE(broke({kEnd, word(1, 5), kEnd}, Rule::no_end));
  EXPECT_TRUE(judge(std::vector{loop(2), loop(2), loop(2), loop(2), word(1, 5), kEndLoop, kEndLoop, kEndLoop,
                                kEndLoop, kEnd},
                    config)
                  .sound);
}

TEST(ProgramRules, random_records_never_harm) {
  for (std::uint64_t seed = 0; seed < 20'000; ++seed) {
    test::Random random(seed);
    Bytes bytes;
    const std::uint64_t records = random.range(1, 12);
    for (std::uint64_t i = 0; i < records; ++i)
      test::pack({static_cast<std::uint8_t>(random.range(0, 15) & (random.chance(80) ? 7U : 15U)),
                  static_cast<std::uint32_t>(random.next()) & (random.chance(50) ? 7U : kMaxArg),
                  static_cast<std::uint32_t>(random.next()) & (random.chance(50) ? 15U : 0xFFFFFFFFU)},
                 bytes);
    const Verdict verdict = judge(bytes, random_limits(random));
    EXPECT_EQ(verdict.sound, verdict.found.empty()) << seed;
  }
}

}  // namespace
}  // namespace symrig::protocol::program_rules_test
