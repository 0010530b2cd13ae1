// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/trace_line.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::trace_line_test {
namespace {

using namespace std::chrono_literals;

// As Linux 6.1 prints them with trace_clock=mono: one from a running task with its name, one from a task that
// has ended.
constexpr std::string_view kRise =
    "         symrigd-312     [000] d..1.    21.276061: gpio_value: 1009 set 1";
constexpr std::string_view kFall = "           <...>-77      [000] ..... 12345.000002: gpio_value: 504 set 0";

TEST(TraceLine, tells_who_was_set_to_what_and_when) {
  EXPECT_EQ(std::get<LineSet>(parse_trace_line(kRise)), (LineSet{1009, true, 21'276'061us}));
  EXPECT_EQ(std::get<LineSet>(parse_trace_line(kFall)), (LineSet{504, false, 12'345'000'002us}));
}

TEST(TraceLine, tells_that_events_were_lost) {
  EXPECT_EQ(std::get<EventsLost>(parse_trace_line("CPU:0 [LOST 5231 EVENTS]")), (EventsLost{5231}));
  EXPECT_TRUE(std::holds_alternative<EventsLost>(parse_trace_line("CPU:0 [LOST EVENTS]")));
}

TEST(TraceLine, is_deaf_to_everything_else) {
  for (const std::string_view line :
       {"", "# tracer: nop", "  symrigd-312 [000] d..1. 21.276061: gpio_value: 1009 get 1",
        "  symrigd-312 [000] d..1. 21.276061: gpio_direction: 1009 out (0)",
        "  x-1 [000] d..1. 21.27606: gpio_value: 1009 set 1",
        "  x-1 [000] d..1. later: gpio_value: 1009 set 1", ": gpio_value: 1009 set 1",
        "  x-1 [000] d..1. 21.276061: gpio_value: set 1",
        "  x-1 [000] d..1. 21.276061: gpio_value: 1009 set"})
    EXPECT_TRUE(std::holds_alternative<std::monostate>(parse_trace_line(line))) << line;
}

// The lines do not depend on how read() splits the text.
TEST(LineSplitter, puts_lines_together_from_any_pieces) {
  const std::string text = "first\n\nthird line\nfourth";
  const std::vector<std::string> lines{"first", "", "third line"};
  for (std::size_t size = 1; size <= text.size(); ++size) {
    LineSplitter splitter;
    std::vector<std::string> seen;
    for (std::size_t at = 0; at < text.size(); at += size)
      for (const std::string& line : splitter.feed(std::string_view(text).substr(at, size)))
        seen.push_back(line);
    EXPECT_EQ(seen, lines) << size;
    EXPECT_EQ(splitter.feed("\n"), std::vector<std::string>{"fourth"}) << size;
  }
}

}  // namespace
}  // namespace symrig::bench_vm::trace_line_test
