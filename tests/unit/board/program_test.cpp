// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/program.hpp"

#include "bench.hpp"
#include "symrig/board/board_info.hpp"

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <rapidcheck.h>

namespace symrig::ticks_test {
namespace {

using namespace std::chrono_literals;

TEST(Ticks, known_conversions) {
  const TickRate rate{125'000'000};
  EXPECT_EQ(rate.ticks(8ns).count, 1U);
  EXPECT_EQ(rate.ticks(1s).count, 125'000'000U);
  EXPECT_EQ(rate.ticks(4ns).count, 1U);  // half a tick goes up
  EXPECT_EQ(rate.ticks(3ns).count, 0U);
  EXPECT_EQ(rate.nanoseconds(Ticks{125}), 1us);
  EXPECT_EQ(TickRate{12'000'000}.nanoseconds(Ticks{1}), 83ns);
  // ten years at 8 ns
  EXPECT_EQ(rate.ticks(std::chrono::hours(24 * 3650)).count, 39'420'000'000'000'000U);
}

TEST(Ticks, round_trip_is_within_half_a_step) {
  EXPECT_TRUE(rc::check([] {
    const TickRate rate{*rc::gen::inRange<std::uint64_t>(1'000, 1'000'000'000)};
    const Nanoseconds t{*rc::gen::inRange<std::int64_t>(0, 1'000'000'000'000'000'000)};
    const auto back = rate.nanoseconds(rate.ticks(t));
    // |t - ticks / hz| <= half a tick, and half a nanosecond of the way back; at most one for integers.
    const auto bound = static_cast<std::int64_t>(500'000'000 / rate.hz + 1);
    RC_ASSERT(std::abs((back - t).count()) <= bound);
  }));
}

}  // namespace
}  // namespace symrig::ticks_test

namespace symrig::program_test {
namespace {

using namespace std::chrono_literals;

/// Records as 32-bit words, two each, read by hand from the byte table of PROTOCOL.md.
std::vector<std::uint32_t> words(const Program& program) {
  std::vector<std::uint32_t> out;
  const auto bytes = program.bytes();
  for (std::size_t i = 0; i < bytes.size(); i += 4)
    out.push_back(bytes[i] | (std::uint32_t{bytes[i + 1]} << 8U) | (std::uint32_t{bytes[i + 2]} << 16U) |
                  (std::uint32_t{bytes[i + 3]} << 24U));
  return out;
}

TEST(ProgramBuilder, writes_the_records_that_the_steps_mean) {
  ProgramBuilder builder(test::default_info());
  const auto program = builder.mark(9)
                           .set("lamp_enable", true)
                           .hold(1us)
                           .loop(3)
                           .pulse("camera_trigger", 8us)
                           .hold(16us)
                           .end_loop()
                           .wait_edge("vsync", EdgeKind::falling, 1ms, OnTimeout::abort)
                           .set("lamp_enable", false)
                           .hold(40ns)
                           .end();
  ASSERT_OK(program);
  const std::vector<std::uint32_t> expected{0x50000009, 0,      0x10000004, 125,  0x20000000, 3,
                                            0x10000006, 1000,   0x10000004, 2000, 0x30000000, 0,
                                            0x400000A3, 125000, 0x10000000, 5,    0x60000000, 0};
  EXPECT_EQ(words(*program), expected);
}

TEST(ProgramBuilder, lines_set_before_a_wait_go_out_first) {
  ProgramBuilder builder(test::default_info());
  const auto program =
      builder.set("lamp_enable", true).wait_edge("vsync", EdgeKind::rising, 1us, OnTimeout::keep_going).end();
  ASSERT_OK(program);
  const std::vector<std::uint32_t> expected{0x10000004, 5, 0x40000003, 125, 0x60000004, 0};
  EXPECT_EQ(words(*program), expected);
}

TEST(ProgramBuilder, a_hold_too_long_for_one_record_takes_several_of_exactly_that_sum) {
  BoardInfo info = test::default_info();
  for (const std::uint64_t duration : {std::uint64_t{0x1'0000'0000}, std::uint64_t{0x1'0000'0003},
                                       std::uint64_t{0x2'FFFF'FFFE}, std::uint64_t{50'000'000'000}}) {
    ProgramBuilder builder(info);
    const auto program = builder.hold(Ticks{duration}).end();
    ASSERT_OK(program);
    const auto records = words(*program);
    std::uint64_t sum = 0;
    for (std::size_t i = 1; i + 2 < records.size(); i += 2) {
      sum += records[i];
      EXPECT_GE(records[i], info.min_dwell.count);
    }
    EXPECT_EQ(sum, duration);
  }
}

/// The first mistake is what end() returns.
void expect_error(ProgramBuilder& builder, ErrorCode code, const std::string& part) {
  const auto program = builder.end();
  ASSERT_FALSE(program.ok()) << part;
  EXPECT_EQ(program.error().code, code) << program.error().line();
  EXPECT_NE(program.error().line().find(part), std::string::npos) << program.error().line();
}

TEST(ProgramBuilder, each_mistake_has_a_line_that_names_it) {
  const BoardInfo info = test::default_info();
  const auto fresh = [&] { return ProgramBuilder(info); };
  ProgramBuilder a = fresh();
  expect_error(a.set("laser", true), ErrorCode::unknown_name, "no output 'laser'");
  ProgramBuilder b = fresh();
  expect_error(b.set("vsync", true), ErrorCode::unknown_name, "no output 'vsync'");
  ProgramBuilder c = fresh();
  expect_error(c.hold(39ns - 4ns), ErrorCode::bad_argument, "hold for at least 40 ns");
  ProgramBuilder d = fresh();
  expect_error(d.hold(-1ns), ErrorCode::bad_argument, "negative");
  ProgramBuilder e = fresh();
  expect_error(e.loop(0), ErrorCode::bad_argument, "0 rounds");
  ProgramBuilder f = fresh();
  expect_error(f.end_loop(), ErrorCode::bad_argument, "end_loop without loop");
  ProgramBuilder g = fresh();
  expect_error(g.loop(2).hold(1us), ErrorCode::bad_argument, "not closed");
  ProgramBuilder h = fresh();
  expect_error(h.loop(2).set("lamp_enable", true).hold(1us).end_loop(), ErrorCode::bad_argument,
               "'lamp_enable'");
  ProgramBuilder i = fresh();
  expect_error(i.wait_edge("lamp_enable", EdgeKind::both, 1ms, OnTimeout::abort), ErrorCode::unknown_name,
               "no input 'lamp_enable'");
  ProgramBuilder j = fresh();
  expect_error(j.wait_edge("vsync", EdgeKind::both, 0ns, OnTimeout::abort), ErrorCode::bad_argument,
               "time-out");
  ProgramBuilder k = fresh();
  expect_error(k.mark(1U << 28U), ErrorCode::bad_argument, "mark");
  ProgramBuilder l = fresh();
  for (int depth = 0; depth < 5; ++depth) l.loop(2);
  expect_error(l, ErrorCode::bad_argument, "nested too deeply");
  BoardInfo tiny = info;
  tiny.program_bytes = 16;
  ProgramBuilder m(tiny);
  expect_error(m.hold(1us).hold(1us), ErrorCode::limit, "16 bytes");
}

TEST(Program, bytes_that_are_no_records_are_refused) {
  EXPECT_FALSE(Program::from_bytes(std::vector<std::uint8_t>(12)).ok());
  EXPECT_FALSE(Program::from_bytes({}).ok());
}

}  // namespace
}  // namespace symrig::program_test

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
