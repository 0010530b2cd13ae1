// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/ports.hpp"

#include "assert_ok.hpp"
#include "bench-vm/scene/tests/fake_guest.hpp"
#include "symrig/base/time.hpp"

#include <cstdlib>
#include <cstring>

#include <gtest/gtest.h>

namespace symrig::bench_vm::ports_test {
namespace {

using namespace std::chrono_literals;

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

}  // namespace
}  // namespace symrig::bench_vm::ports_test
