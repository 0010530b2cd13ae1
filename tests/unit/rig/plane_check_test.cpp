// SPDX-License-Identifier: Apache-2.0
// The check of bit planes with light, when a rig is opened: projectors that show the planes in another way
// than the rig file says.
#include "assert_ok.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <functional>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::plane_check_test {
namespace {

using board_sim::SimPlaneProjector;

/// A virtual rig in which the projector has faults.
Result<std::unique_ptr<VirtualRig>> open_with(const std::function<void(SimPlaneProjector::Faults&)>& faults,
                                              const std::string& noise = "camera",
                                              const std::function<void(RigOptions&)>& options = {},
                                              const std::string& profile = "dlpc350") {
  VirtualRigHooks hooks;
  hooks.planes = [&](SimPlaneProjector& raster, board_sim::SimBoard& /*board*/) { faults(raster.faults); };
  hooks.options = [&](RigOptions& set) {
    if (options) options(set);
  };
  return open_virtual_rig(fmt::format("sim:vgroove-textured?size=24x32&profile={}&noise={}", profile, noise),
                          hooks);
}

/// In the place of plane k comes plane order[k].
Result<std::unique_ptr<VirtualRig>> open_in_order(const std::vector<int>& order,
                                                  const std::string& noise = "camera",
                                                  const std::string& profile = "dlpc350") {
  return open_with([&order](SimPlaneProjector::Faults& faults) { faults.order = order; }, noise, {}, profile);
}

std::vector<int> in_place() {
  std::vector<int> order(24);
  std::iota(order.begin(), order.end(), 0);
  return order;
}

std::string refusal_of(const Result<std::unique_ptr<VirtualRig>>& opened) {
  EXPECT_FALSE(opened.ok());
  if (opened.ok()) return {};
  EXPECT_EQ(opened.error().code, ErrorCode::device_refused);
  return opened.error().line();
}

void expect_parts(const std::string& line, const std::vector<std::string>& parts) {
  for (const std::string& part : parts) EXPECT_NE(line.find(part), std::string::npos) << part << ": " << line;
}

TEST(PlaneCheck, planes_in_their_places_are_taken_without_a_warning) {
  for (const char* noise : {"camera", "off"}) {
    const auto opened = open_in_order(in_place(), noise);
    ASSERT_OK(opened);
    EXPECT_TRUE((*opened)->rig().trouble().warnings.empty());
    EXPECT_EQ((*opened)->rig().trouble().retaken, 0);
  }
}

// Two neighbours are the least that an order can differ in.
TEST(PlaneCheck, any_two_neighbours_that_change_places_are_refused) {
  for (std::size_t k = 0; k + 1 < 24; ++k) {
    std::vector<int> order = in_place();
    std::swap(order[k], order[k + 1]);
    const std::string line = refusal_of(open_in_order(order, "off"));
    expect_parts(line, {"in the place of plane " + std::to_string(k) + " came plane " + std::to_string(k + 1),
                        "of plane " + std::to_string(k + 1) + " plane " + std::to_string(k)});
  }
}

// A camera that is ready after a few planes looks at several planes of a picture.
TEST(PlaneCheck, any_two_planes_that_change_places_are_refused_with_a_fast_camera) {
  ASSERT_OK(open_in_order(in_place(), "camera", "dlpc350-fast"));
  for (std::size_t k = 0; k < 24; ++k)
    for (std::size_t m = k + 1; m < 24; ++m) {
      std::vector<int> order = in_place();
      std::swap(order[k], order[m]);
      const std::string line = refusal_of(open_in_order(order, "off", "dlpc350-fast"));
      expect_parts(line,
                   {fmt::format("in the place of plane {} came plane {}, of plane {} plane {}", k, m, m, k)});
    }
  // Steps between the planes that a picture lights, too.
  for (int shift = 1; shift < 24; ++shift) {
    std::vector<int> order = in_place();
    for (int& plane : order) plane = (plane + shift) % 24;
    refusal_of(open_in_order(order, "off", "dlpc350-fast"));
  }
}

// The check takes 13 refreshes instead of 26. Metering and dark photographs are no slower.
TEST(PlaneCheck, takes_less_time_with_a_faster_camera) {
  const auto opening = [](const char* profile) {
    const auto opened = open_with([](SimPlaneProjector::Faults&) {}, "camera", {}, profile);
    return opened ? (*opened)->rig().cost().rig_seconds : 0;
  };
  EXPECT_LT(opening("dlpc350-fast"), opening("dlpc350") - 12.0 / 60);
}

TEST(PlaneCheck, another_order_of_colours_is_refused_with_the_key_that_names_it) {
  std::vector<int> order = in_place();
  for (std::size_t k = 0; k < 8; ++k) std::swap(order[k], order[k + 8]);
  for (const char* noise : {"camera", "off"})
    expect_parts(refusal_of(open_in_order(order, noise)),
                 {"in the place of plane 0 came plane 8, of plane 1 plane 9", "and so on",
                  "set projector.plane_order = \"RGB\""});
  for (std::size_t k = 0; k < 24; ++k) order[k] = static_cast<int>(8 * (k / 8) + 7 - k % 8);
  expect_parts(refusal_of(open_in_order(order)), {"set projector.plane_order = \"GRB highest first\""});
}

TEST(PlaneCheck, a_missing_or_doubled_plane_is_refused) {
  std::vector<int> order = in_place();
  for (const std::size_t missing : {0U, 12U, 17U, 23U}) {  // 0 and 12 have the reference shots, too
    order = in_place();
    order[missing] = -1;
    expect_parts(refusal_of(open_in_order(order)),
                 {fmt::format("in the place of plane {} came no plane", missing), "pattern table"});
  }
  order = in_place();
  order[17] = 16;
  expect_parts(refusal_of(open_in_order(order)), {"in the place of plane 17 came plane 16"});
}

TEST(PlaneCheck, edges_that_are_a_plane_off_are_refused) {
  for (const int shift : {-2, -1, 1, 2}) {
    std::vector<int> order = in_place();
    for (int& plane : order) plane = plane + shift < 0 || plane + shift > 23 ? -1 : plane + shift;
    expect_parts(refusal_of(open_in_order(order)),
                 {std::to_string(std::abs(shift)) + (std::abs(shift) == 1 ? " plane " : " planes ") +
                      (shift > 0 ? "late" : "early"),
                  "projector.plane_delay_us"});
  }
}

TEST(PlaneCheck, a_sequence_that_does_not_begin_again_at_vsync_is_refused) {
  expect_parts(refusal_of(open_with([](SimPlaneProjector::Faults& faults) { faults.runs_free = true; })),
               {"each refresh must begin with plane 0"});
}

// A camera whose shortest exposure is longer than a plane of 684 us cannot see a single plane.
TEST(PlaneCheck, a_camera_with_longer_exposures_than_a_plane_is_told_what_was_not_checked) {
  const auto longer = [](RigOptions& options) { options.setup.camera.min_exposure = Nanoseconds{1'000'000}; };
  const auto opened = open_with([](SimPlaneProjector::Faults&) {}, "camera", longer);
  ASSERT_OK(opened);
  const auto& warnings = (*opened)->rig().trouble().warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("the order of the bit planes was not checked"), std::string::npos);
}

}  // namespace
}  // namespace symrig::plane_check_test
