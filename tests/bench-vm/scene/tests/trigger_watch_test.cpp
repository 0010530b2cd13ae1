// SPDX-License-Identifier: Apache-2.0
#include "assert_ok.hpp"
#include "bench-vm/scene/ports.hpp"
#include "bench-vm/scene/watchers.hpp"
#include "symrig/base/time.hpp"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

namespace symrig::bench_vm::trigger_watch_test {
namespace {

using namespace std::chrono_literals;

/// Files in place of the guest's devices. Tests read what was written to them. The trace is a named pipe.
class FakeGuest {
 public:
  FakeGuest() {
    std::string name = (std::filesystem::temp_directory_path() / "bench-XXXXXX").string();
    folder_ = ::mkdtemp(name.data());
    for (std::size_t i = 0; i < places_.gpio_lines.size(); ++i) {
      std::filesystem::create_directories(line_folder(i));
      std::ofstream(line_folder(i) / "pull") << "";
    }
    std::ofstream(folder_ / "inject") << "";
    ::mkfifo((folder_ / "trace_pipe").c_str(), 0600);
    places_.gpio_sysfs = folder_.string();
    places_.tracefs = folder_.string();
  }
  FakeGuest(const FakeGuest&) = delete;
  FakeGuest& operator=(const FakeGuest&) = delete;
  ~FakeGuest() { std::filesystem::remove_all(folder_); }

  const BenchPlaces& places() const { return places_; }
  std::string pulled(const std::string& line) const {
    return read(line_folder(static_cast<std::size_t>(*places_.line(line))) / "pull");
  }
  std::string inject() const { return (folder_ / "inject").string(); }
  std::string injected() const { return read(folder_ / "inject"); }

 private:
  std::filesystem::path line_folder(std::size_t i) const {
    return folder_ / ("sim_gpio" + std::to_string(i));
  }
  static std::string read(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }

  std::filesystem::path folder_;
  BenchPlaces places_{"", 500, {"camera_trigger", "camera_strobe", "vsync"}, "", ""};
};

TEST(BenchPlaces, come_from_the_environment) {
  const std::pair<const char*, const char*> variables[] = {{"BENCH_GPIO_SYSFS", "/sys/chip"},
                                                           {"BENCH_GPIO_BASE", "1008"},
                                                           {"BENCH_GPIO_LINES", "one two six"},
                                                           {"BENCH_TRACEFS", "/sys/tracing"},
                                                           {"BENCH_VKMS", "/dev/dri/card0"}};
  for (const auto& [name, value] : variables) ASSERT_EQ(::setenv(name, value, 1), 0);
  const auto places = BenchPlaces::from_environment();
  ASSERT_OK(places);
  EXPECT_EQ(places->gpio_base, 1008);
  EXPECT_EQ(places->line("six").value(), 2);
  EXPECT_EQ(places->line("seven").error().code, ErrorCode::unknown_name);
  for (const auto& [name, value] : variables) {
    ::unsetenv(name);
    const auto without = BenchPlaces::from_environment();
    ASSERT_FALSE(without) << name;
    EXPECT_NE(without.error().line().find(name), std::string::npos);
    ::setenv(name, value, 1);
  }
  ::setenv("BENCH_GPIO_BASE", "12x", 1);
  EXPECT_EQ(BenchPlaces::from_environment().error().code, ErrorCode::bad_argument);
}

TEST(InputWire, writes_levels_and_says_when) {
  const FakeGuest guest;
  const auto wire = InputWire::open(guest.places(), "camera_strobe");
  ASSERT_OK(wire);
  const Nanoseconds before = steady_now();
  const auto up = wire->pull(true);
  const Nanoseconds after = steady_now();
  ASSERT_OK(up);
  EXPECT_EQ(guest.pulled("camera_strobe"), "pull-up");
  EXPECT_GE(up->time - up->doubt, before - 1ns);
  EXPECT_LE(up->time + up->doubt, after + 1ns);
  ASSERT_OK(wire->pull(false));
  EXPECT_EQ(guest.pulled("camera_strobe").substr(0, 9), "pull-down");
  EXPECT_FALSE(InputWire::open(guest.places(), "nowhere"));
}

TEST(CameraPort, hands_over_head_and_pixels_in_one_piece) {
  const FakeGuest guest;
  auto port = CameraPort::open(guest.inject());
  ASSERT_OK(port);
  const std::uint8_t pixels[] = {1, 2, 3};
  const auto taken = port->deliver({5s, 7, true}, pixels);
  ASSERT_OK(taken);
  EXPECT_EQ(*taken, CameraPort::Taken::yes);
  const std::string written = guest.injected();
  ASSERT_EQ(written.size(), 19U);
  std::uint64_t stamp = 0;
  std::uint32_t skip = 0, flags = 0;
  std::memcpy(&stamp, written.data(), 8);
  std::memcpy(&skip, written.data() + 8, 4);
  std::memcpy(&flags, written.data() + 12, 4);
  EXPECT_EQ(stamp, 5'000'000'000U);
  EXPECT_EQ(skip, 7U);
  EXPECT_EQ(flags, 1U);
  EXPECT_EQ(written.substr(16), "\x01\x02\x03");
  EXPECT_EQ(port->state().error().code, ErrorCode::io);  // a plain file has no camera state
  EXPECT_EQ(port->plug(false).error().code, ErrorCode::io);
  EXPECT_EQ(CameraPort::open("/nowhere/inject").error().code, ErrorCode::io);
}

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

/// A watch, in its own thread, on a trace that the test writes.
class Watched : public testing::Test {
 protected:
  void SetUp() override {
    std::thread([this] { allowed_ = set_priority(1).ok(); }).join();
    if (!allowed_) GTEST_SKIP() << "no real-time priority here";
    auto opened = TriggerWatch::open(guest_.places(), 3ms, faults_, stage_);
    ASSERT_OK(opened);
    watch_.emplace(*std::move(opened));
    trace_.open(guest_.places().tracefs + "/trace_pipe", std::ios::app);
    thread_ = std::thread([this] { watch_->run(); });
  }
  void TearDown() override {
    stage_.stop();
    if (thread_.joinable()) thread_.join();
  }
  void set(int gpio, int level, Nanoseconds at) {
    trace_ << fmt::format("  symrigd-7 [000] d..1. {}.{:06}: gpio_value: {} set {}\n", at / 1s,
                          (at % 1s).count() / 1000, gpio, level)
           << std::flush;
  }
  Exposure next() {
    for (;;)
      if (const auto exposure = stage_.next_exposure(0ns, steady_now() + 1s)) return *exposure;
  }

  FakeGuest guest_;
  FaultRates faults_;
  Stage stage_;
  std::optional<TriggerWatch> watch_;
  std::ofstream trace_;
  std::thread thread_;
  bool allowed_ = false;
};

TEST_F(Watched, makes_an_exposure_of_each_pulse) {
  const Nanoseconds start = steady_now();
  set(501, 1, 100ms);  // another line
  set(500, 1, 100ms);
  set(500, 1, 101ms);  // the same level
  set(500, 0, 110ms);
  set(500, 1, 111ms);  // too early
  set(500, 0, 112ms);
  set(500, 1, 120ms);
  set(500, 0, 130ms);
  const Exposure first = next(), second = next();
  EXPECT_EQ(first.frame, 0U);
  EXPECT_EQ(second.frame, 1U);
  EXPECT_GE(first.begin.time, start);  // the strobe's edges, not the trigger's
  EXPECT_GT(first.end.time, first.begin.time);
  EXPECT_GT(second.begin.time, first.end.time);
  TearDown();
  EXPECT_EQ(watch_->missed(), 1U);
  EXPECT_EQ(watch_->exposures(), 2U);
  EXPECT_EQ(guest_.pulled("camera_strobe").substr(0, 9), "pull-down");
  EXPECT_FALSE(stage_.failure());
}

TEST_F(Watched, answers_no_trigger_without_its_cable) {
  stage_.plug_camera(false);
  set(500, 1, 100ms);
  set(500, 0, 110ms);
  set(501, 0, 111ms);
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(guest_.pulled("camera_strobe"), "");
  stage_.plug_camera(true);
  set(500, 1, 120ms);
  set(500, 0, 130ms);
  EXPECT_EQ(next().frame, 0U);
}

// An incomplete truth is useless.
TEST_F(Watched, ends_everything_when_events_were_lost) {
  trace_ << "CPU:0 [LOST 12 EVENTS]\n" << std::flush;
  while (!stage_.stopped()) std::this_thread::sleep_for(1ms);
  ASSERT_TRUE(stage_.failure());
  EXPECT_EQ(stage_.failure()->code, ErrorCode::fault);
}

}  // namespace
}  // namespace symrig::bench_vm::trigger_watch_test
