// SPDX-License-Identifier: Apache-2.0
// A rig that moves after its registration is noticed.
#include "symrig/calibration/motion_watch.hpp"

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace symrig::motion_watch_test {
namespace {

constexpr const char* kScene = "sim:vgroove-textured?size=32x32&fine=4&camera=152x152&turn=1.5&zoom=0.784";

std::unique_ptr<VirtualRig> rig_with(const std::string& keys) {
  auto rig = open_virtual_rig(kScene + keys);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  return *std::move(rig);
}

/// All cases begin with the same registration, which takes longer than most of them.
class Moved : public testing::Test {
 protected:
  static const Result<Registration>& registration() {
    static const Result<Registration> found = register_camera(*rig_with("&shift=3.3,-2.1"));
    return found;
  }
  void SetUp() override { ASSERT_TRUE(registration().ok()) << registration().error().line(); }
  static Motion motion(const std::string& keys) {
    const auto rig = rig_with(keys);
    const auto found = registration()->watch().measure(*rig);
    EXPECT_TRUE(found.ok()) << found.error().line();
    return found.ok() ? *found : Motion{};
  }
};

// The card: within a third, because stripes have sharper edges than pixels. The camera then looks further
// down.
TEST_F(Moved, is_measured_to_a_third) {
  const Motion still = motion("&shift=3.3,-2.1&seed=1");
  EXPECT_LT(still.distance(), 5 * still.sigma);
  EXPECT_LT(still.sigma, 0.001);
  EXPECT_NEAR(still.brightness, 1, 0.001);
  for (const double off : {0.005, 0.02, 0.05}) {
    const Motion down = motion("&shift=" + std::to_string(3.3 + off) + ",-2.1");
    EXPECT_NEAR(down.row, off, off / 3 + 5 * down.sigma) << off;
    EXPECT_LT(std::abs(down.col), off / 3 + 5 * down.sigma) << off;
    const Motion left = motion("&shift=3.3," + std::to_string(-2.1 - off));
    EXPECT_NEAR(left.col, -off, off / 3 + 5 * left.sigma) << off;
  }
}

TEST_F(Moved, a_capture_on_a_rig_that_moves_stops_with_the_numbers) {
  const auto moving = rig_with("&shift=3.3,-2.1&moves=1");
  auto weights = registration()->weights();
  ASSERT_TRUE(weights.ok());
  RegisteredProbe probe(*moving, *std::move(weights));
  probe.watch_motion(registration()->watch());
  const auto result = capture(probe, {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::fault);
  EXPECT_NE(result.error().line().find("has moved"), std::string::npos) << result.error().line();
  // The second check at the latest, after 32 photographs and some that were asked for together.
  EXPECT_LE(probe.cost().photographs, 2 + 32 + 16 + 2);
}

TEST_F(Moved, a_rig_that_stays_is_captured) {
  const auto rig = rig_with("&shift=3.3,-2.1");
  auto weights = registration()->weights();
  ASSERT_TRUE(weights.ok());
  RegisteredProbe probe(*rig, *std::move(weights));
  probe.watch_motion(registration()->watch());
  const auto result = capture(probe, {});
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_TRUE(probe.check_motion().ok());
  EXPECT_GT(probe.cost().photographs, result->patterns);
}

// 0.03 cells add a third to an error and cost patterns; the registration of the new place costs neither.
TEST_F(Moved, a_rig_that_is_registered_again_is_captured) {
  const auto moved = rig_with("&shift=3.33,-2.1");
  auto weights = registration()->weights();
  ASSERT_TRUE(weights.ok());
  RegisteredProbe probe(*moved, *std::move(weights));
  const std::string identity = probe.identity();
  probe.watch_motion(registration()->watch());
  probe.register_again([](Probe& rig) { return register_camera(rig); });
  const auto result = capture(probe, {});
  ASSERT_TRUE(result.ok()) << result.error().line();
  EXPECT_EQ(probe.registered_again(), 1);
  EXPECT_EQ(probe.identity(), identity) << "a log goes on with the registration that it began with";
  EXPECT_TRUE(probe.check_motion().ok());
  EXPECT_EQ(probe.registered_again(), 1);
  // As a capture that began where the rig is now: the same photographs but for their noise.
  auto there = register_camera(*moved);
  ASSERT_TRUE(there.ok());
  auto new_weights = there->weights();
  ASSERT_TRUE(new_weights.ok());
  RegisteredProbe fresh(*moved, *std::move(new_weights));
  const auto direct = capture(fresh, {});
  ASSERT_TRUE(direct.ok());
  EXPECT_NEAR(static_cast<double>(result->patterns), static_cast<double>(direct->patterns),
              0.1 * static_cast<double>(direct->patterns));
  const auto error = [&](const CaptureResult& found) {
    const auto measured = evaluate(
        found.tensor, [&](const Image<float>& p) -> Result<Image<float>> { return moved->truth().apply(p); });
    EXPECT_TRUE(measured.ok());
    return measured->frobenius;
  };
  EXPECT_LE(error(*result), 1.2 * error(*direct));
}

TEST_F(Moved, a_new_registration_that_fails_ends_the_capture) {
  const auto moved = rig_with("&shift=3.33,-2.1");
  auto weights = registration()->weights();
  ASSERT_TRUE(weights.ok());
  RegisteredProbe probe(*moved, *std::move(weights));
  probe.watch_motion(registration()->watch());
  probe.register_again([](Probe&) -> Result<Registration> {
    return Error{ErrorCode::interrupted, "stopped", "run it again"};
  });
  EXPECT_EQ(probe.check_motion().error().code, ErrorCode::interrupted);
  EXPECT_EQ(probe.registered_again(), 0);
}

TEST_F(Moved, photographs_that_do_not_fit_are_refused) {
  const auto other = open_virtual_rig("sim:plane?size=32x32&camera=150x152");
  ASSERT_TRUE(other.ok());
  EXPECT_EQ(registration()->watch().measure(**other).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(registration()->watch().compare({}).error().code, ErrorCode::size_mismatch);
  const auto dark = rig_with("&shift=1000,1000");
  const auto motion = registration()->watch().measure(*dark);
  // A camera that looks elsewhere sees nothing.
  ASSERT_FALSE(motion.ok());
  EXPECT_EQ(motion.error().code, ErrorCode::bad_value);
}

}  // namespace
}  // namespace symrig::motion_watch_test
