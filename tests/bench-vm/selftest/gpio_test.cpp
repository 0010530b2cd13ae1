// SPDX-License-Identifier: Apache-2.0
// Lines of the bench: a program's outputs are traced with their times, and the bench's inputs reach a program
// as edges.
#include "bench-vm/selftest/guest.hpp"

#include <array>
#include <memory>
#include <random>
#include <sstream>

#include <gpiod.h>
#include <gtest/gtest.h>

namespace symrig::bench_vm::gpio_test {
namespace {

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};

class Gpio : public testing::Test {
 protected:
  void SetUp() override {
    chip_.reset(gpiod_chip_open(place("BENCH_GPIO_CHIP").c_str()));
    ASSERT_NE(chip_, nullptr);
  }
  gpiod_line* line(const char* name) const { return gpiod_chip_find_line(chip_.get(), name); }

  /// From outside, like the wire of an input.
  static bool pull(const gpiod_line* input, bool high) {
    const unsigned offset = gpiod_line_offset(const_cast<gpiod_line*>(input));  // NOLINT(*-const-cast)
    return write_text(place("BENCH_GPIO_SYSFS") + "/sim_gpio" + std::to_string(offset) + "/pull",
                      high ? "pull-up" : "pull-down");
  }

  std::unique_ptr<gpiod_chip, CloseChip> chip_;
};

TEST_F(Gpio, has_its_lines_by_name_in_the_promised_order) {
  std::istringstream names(place("BENCH_GPIO_LINES"));
  unsigned offset = 0;
  for (std::string name; names >> name; ++offset) {
    ASSERT_NE(line(name.c_str()), nullptr) << name;
    EXPECT_EQ(gpiod_line_offset(line(name.c_str())), offset) << name;
  }
  EXPECT_EQ(offset, 16U);
  EXPECT_STREQ(gpiod_chip_label(chip_.get()), "symrig-bench");
}

TEST_F(Gpio, traces_every_level_that_is_set_in_order_and_in_time) {
  const std::array lines{line("projector_trigger"), line("camera_trigger"), line("laser_enable")};
  for (gpiod_line* output : lines) ASSERT_EQ(gpiod_line_request_output(output, "selftest", 0), 0);
  clear_trace();
  std::mt19937 random(1);
  std::vector<TracedLevel> set;
  const std::int64_t begin = now_ns();
  for (int i = 0; i < 1000; ++i) {
    gpiod_line* output = lines.at(random() % lines.size());
    const bool level = (random() & 1U) != 0;
    ASSERT_EQ(gpiod_line_set_value(output, level ? 1 : 0), 0);
    set.push_back({static_cast<int>(gpiod_line_offset(output)), level, 0});
  }
  const std::int64_t end = now_ns();
  const auto traced = traced_levels();
  ASSERT_EQ(traced.size(), set.size());
  std::int64_t last = begin - 1000;  // the trace has whole microseconds
  for (std::size_t i = 0; i < set.size(); ++i) {
    EXPECT_EQ(traced[i].line, set[i].line) << i;
    EXPECT_EQ(traced[i].level, set[i].level) << i;
    EXPECT_GE(traced[i].stamp_ns, last) << i;
    last = traced[i].stamp_ns;
  }
  EXPECT_LE(last, end + 1000);
}

TEST_F(Gpio, hands_every_pull_to_the_program_with_direction_and_time) {
  gpiod_line* vsync = line("vsync");
  ASSERT_TRUE(pull(vsync, false));
  ASSERT_EQ(gpiod_line_request_both_edges_events(vsync, "selftest"), 0);
  for (int i = 0; i < 400; ++i) {
    const bool high = i % 2 == 0;
    const std::int64_t before = now_ns();
    ASSERT_TRUE(pull(vsync, high));
    const timespec patience{.tv_sec = 10, .tv_nsec = 0};
    ASSERT_EQ(gpiod_line_event_wait(vsync, &patience), 1) << "edge " << i << " never came";
    gpiod_line_event event{};
    ASSERT_EQ(gpiod_line_event_read(vsync, &event), 0);
    EXPECT_EQ(event.event_type, high ? GPIOD_LINE_EVENT_RISING_EDGE : GPIOD_LINE_EVENT_FALLING_EDGE) << i;
    const std::int64_t stamp = event.ts.tv_sec * 1'000'000'000 + event.ts.tv_nsec;
    EXPECT_GE(stamp, before) << i;
    EXPECT_LE(stamp, now_ns()) << i;
  }
}

/// Shows what a program must handle: if it reads too late, the kernel keeps 16 edges and drops the others
/// silently.
TEST_F(Gpio, keeps_sixteen_edges_for_a_program_that_does_not_read) {
  gpiod_line* strobe = line("camera_strobe");
  ASSERT_TRUE(pull(strobe, false));
  ASSERT_EQ(gpiod_line_request_both_edges_events(strobe, "selftest"), 0);
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(pull(strobe, i % 2 == 0));
    sleep_until(now_ns() + 2'000'000);  // gpio-sim interrupts later; two changes before give one edge
  }
  int kept = 0;
  const timespec none{};
  for (gpiod_line_event event{}; gpiod_line_event_wait(strobe, &none) == 1; ++kept)
    ASSERT_EQ(gpiod_line_event_read(strobe, &event), 0);
  EXPECT_EQ(kept, 16);
}

TEST_F(Gpio, reads_pulls_as_levels) {
  gpiod_line* interlock = line("interlock");
  ASSERT_EQ(gpiod_line_request_input(interlock, "selftest"), 0);
  for (const bool high : {true, false, true}) {
    ASSERT_TRUE(pull(interlock, high));
    EXPECT_EQ(gpiod_line_get_value(interlock), high ? 1 : 0);
  }
}

}  // namespace
}  // namespace symrig::bench_vm::gpio_test
