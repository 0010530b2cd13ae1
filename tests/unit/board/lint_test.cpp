// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/lint.hpp"

#include "bench.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::lint_test {
namespace {

using namespace std::chrono_literals;

Program lamp_pulses(Nanoseconds on, Nanoseconds off) {
  ProgramBuilder builder(test::default_info());
  return *builder.loop(10).pulse("lamp_enable", on).hold(off).end_loop().end();
}

TEST(Lint, nothing_to_object_to) {
  EXPECT_TRUE(lint(lamp_pulses(1ms, 1ms), test::default_info(), {}).empty());
}

TEST(Lint, names_the_rule_the_line_and_the_shortest_legal_alternative) {
  const std::vector<LineConfig> lines{
      {.line = "lamp_enable", .hazard = Hazard::lamp, .max_on = 500us, .max_duty = 0.25}};
  const auto findings = lint(lamp_pulses(1ms, 1ms), test::default_info(), lines);
  ASSERT_FALSE(findings.empty());
  EXPECT_EQ(findings[0].rule, "max_on");
  EXPECT_EQ(findings[0].line, "lamp_enable");
  EXPECT_EQ(findings[0].what, "on for 1 ms (125000 ticks)");
  EXPECT_EQ(findings[0].alternative, "turn it off after at most 500 us (62500 ticks)");
  EXPECT_TRUE(std::any_of(findings.begin(), findings.end(), [](const Finding& f) {
    return f.rule == "duty" && f.alternative == "let it rest for at least 3 ms (375000 ticks)";
  }));
  EXPECT_EQ(findings[0].line_of_text(),
            "record 1: line 'lamp_enable' max_on: on for 1 ms (125000 ticks); "
            "turn it off after at most 500 us (62500 ticks)");
}

TEST(Lint, the_alternative_is_legal) {
  const std::vector<LineConfig> lines{{.line = "lamp_enable", .max_on = 500us, .max_duty = 0.25}};
  EXPECT_TRUE(lint(lamp_pulses(500us, 1500us), test::default_info(), lines).empty());
  EXPECT_FALSE(lint(lamp_pulses(500us, 1500us - 8ns), test::default_info(), lines).empty());
}

TEST(Lint, a_configuration_that_makes_no_sense_is_a_finding) {
  const Program program = lamp_pulses(1ms, 1ms);
  const auto first = [&](const LineConfig& line) {
    const std::vector<LineConfig> lines{line};
    const auto findings = lint(program, test::default_info(), lines);
    return findings.empty() ? std::string() : findings[0].what;
  };
  EXPECT_NE(first({.line = "laser"}).find("no line 'laser'"), std::string::npos);
  EXPECT_NE(first({.line = "lamp_enable", .max_duty = 0}).find("max_duty"), std::string::npos);
  EXPECT_NE(first({.line = "lamp_enable", .max_on = -1ns}).find("negative"), std::string::npos);
  EXPECT_NE(first({.line = "vsync", .max_on = 1ms}).find("input"), std::string::npos);
  const std::vector<LineConfig> twice{{.line = "vsync"}, {.line = "vsync"}};
  EXPECT_FALSE(lint(program, test::default_info(), twice).empty());
}

TEST(Lint, what_it_passes_the_board_accepts_and_what_it_objects_to_the_board_refuses) {
  test::Bench bench;
  Board board = bench.connect();
  const std::vector<LineConfig> lines{{.line = "lamp_enable", .max_on = 500us, .max_duty = 0.25}};
  ASSERT_OK(board.configure(lines));
  ASSERT_OK(board.upload(lamp_pulses(500us, 1500us)));
  const auto refused = board.upload(lamp_pulses(500us, 1499us));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::device_refused);
  const auto findings = lint(lamp_pulses(500us, 1499us), board.info(), lines);
  EXPECT_NE(refused.error().what.find(findings[0].line_of_text()), std::string::npos)
      << refused.error().line();
}

}  // namespace
}  // namespace symrig::lint_test
