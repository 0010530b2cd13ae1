// SPDX-License-Identifier: Apache-2.0
// What goes wrong with the controller of bit planes, refresh by refresh. No host is attached, so a program
// before symrig has set the sequence: bench.plane_capture meets the drivers.
#include "bench-vm/scene/controller_on_usb.hpp"

#include "assert_ok.hpp"
#include "usbip/usbip_server.hpp"

#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::bench_vm::controller_on_usb_test {
namespace {

using Kind = ControllerFault::Kind;

TEST(ControllerFaults, are_read_from_their_words) {
  const auto reset = parse_controller_fault("reset@40");
  ASSERT_OK(reset);
  EXPECT_EQ(reset->kind, Kind::reset);
  EXPECT_EQ(reset->after, 40U);
  EXPECT_EQ(parse_controller_fault("table@0")->kind, Kind::table);
  EXPECT_EQ(parse_controller_fault("stall@1")->kind, Kind::stall);
  EXPECT_EQ(parse_controller_fault("hang@1")->kind, Kind::hang);
  for (const std::string text : {"", "reset", "reset@", "reset@-1", "reset@4x", "melt@4", "@4"}) {
    const auto bad = parse_controller_fault(text);
    ASSERT_FALSE(bad.ok()) << text;
    EXPECT_EQ(bad.error().code, ErrorCode::bad_argument);
  }
}

TEST(SceneController, is_of_a_known_kind_and_has_a_port_of_its_own) {
  EXPECT_EQ(SceneController::serve("dlpc410", {}, 0).error().code, ErrorCode::bad_argument);
  const test::UsbIpServer taken(nullptr, 0);
  EXPECT_EQ(SceneController::serve("dlpc900", {}, taken.port()).error().code, ErrorCode::io);
}

// Faults come in their order, counted from the last time that the power came on.
TEST(SceneController, faults_come_after_their_exposures) {
  const auto controller =
      SceneController::serve("dlpc350", {{Kind::stall, 2}, {Kind::hang, 5}, {Kind::reset, 3}}, 0);
  ASSERT_OK(controller);
  const auto faults_after = [&](std::uint64_t exposures) {
    (*controller)->next_refresh(exposures);
    return (*controller)->faults();
  };
  EXPECT_EQ(faults_after(1), 0U);
  EXPECT_EQ(faults_after(2), 1U);
  EXPECT_EQ(faults_after(4), 1U);
  (*controller)->cycle_power(4);
  EXPECT_EQ(faults_after(8), 1U);
  EXPECT_EQ(faults_after(9), 2U);
  EXPECT_EQ(faults_after(20), 2U);  // it hangs
  (*controller)->cycle_power(20);
  EXPECT_EQ(faults_after(22), 2U);
  EXPECT_EQ(faults_after(23), 3U);
}

}  // namespace
}  // namespace symrig::bench_vm::controller_on_usb_test
