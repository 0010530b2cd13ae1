// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/program.hpp"

#include "bench.hpp"
#include "symrig/board/lint.hpp"

#include <cstdint>
#include <initializer_list>
#include <string>
#include <vector>

#include <gtest/gtest.h>

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
