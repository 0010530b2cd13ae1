// SPDX-License-Identifier: Apache-2.0
// A simulated bench whose camera has pixels of its own, with the exact map: what a perfect calibration would
// give.
// A rig that moves after its registration is noticed.
#include "symrig/calibration/registered_probe.hpp"

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/calibration/coaxial_check.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/testing/probe_laws.hpp"

#include <cmath>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::registered_probe_test {
namespace {

/// Four camera pixels along the side of a cell at zoom 1, and a margin on all sides.
constexpr const char* kBench = "&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0.02";

struct Registered {
  std::unique_ptr<VirtualRig> rig;
  std::unique_ptr<RegisteredProbe> probe;
};

Registered registered(const std::string& uri) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  const auto registration = register_camera(**rig);
  EXPECT_TRUE(registration.ok()) << registration.error().line();
  auto weights = registration->weights();
  EXPECT_TRUE(weights.ok()) << weights.error().line();
  auto probe = std::make_unique<RegisteredProbe>(**rig, *std::move(weights));
  return {*std::move(rig), std::move(probe)};
}

// All but reciprocity: what a pixel on the border of two cells sees of each is known only from the flood-lit
// photograph, so a cell may be a percent too bright.
TEST(RegisteredProbe, keeps_the_laws) {
  const Registered bench = registered(std::string("sim:vgroove-textured?size=32x32&fine=2") + kBench);
  expect_probe_laws(*bench.probe, false);
}

TEST(RegisteredProbe, has_the_cells_as_its_grid) {
  // As kBench, with a quarter of the cells and pixels.
  const Registered bench = registered(
      "sim:plane?size=16x16&channels=3&camera=76x76&turn=1.5&zoom=0.784&shift=1.6,-1.1&distortion=0.02");
  EXPECT_EQ(bench.rig->camera_grid(), (Grid{76, 76}));
  EXPECT_EQ(bench.probe->grid(), (Grid{16, 16}));
  EXPECT_EQ(bench.probe->camera_grid(), bench.probe->grid());
  EXPECT_TRUE(check_aligned(*bench.probe).ok());
  EXPECT_EQ(bench.probe->channels(), 3);
  const Pattern white({16, 16}, 1, 1.F);
  const auto photographs = bench.probe->measure({&white, 1});
  ASSERT_TRUE(photographs.ok());
  EXPECT_EQ(photographs->front().mean.grid(), (Grid{16, 16}));
  EXPECT_EQ(photographs->front().mean.channels(), 3);
}

// The edges of mirrored cells lie anywhere inside cells, so the camera's pixels cannot tell their light to a
// tenth. The search must not spend photographs on that: it takes 250, and brute force 1,024.
TEST(RegisteredProbe, a_mirror_is_not_left_to_brute_force) {
  const Registered bench = registered(std::string("sim:mirror?size=32x32&fine=4") + kBench);
  const auto found = capture(*bench.probe, {});
  ASSERT_TRUE(found.ok());
  EXPECT_LT(found->patterns, 400);
  const auto error = evaluate(found->tensor, [&](const Image<float>& p) -> Result<Image<float>> {
    return bench.rig->truth().apply(p);
  });
  ASSERT_TRUE(error.ok());
  EXPECT_LT(error->frobenius, 0.08);
  // Estimates contain what the cells are wrong by, to a factor of 2.
  ASSERT_TRUE(found->estimated);
  EXPECT_GT(found->estimated->frobenius, 0.5 * error->frobenius);
}

// A capture of a bench that nobody aligned needs as many patterns as the coaxial rig, to a tenth, and finds
// its transport. The bar of the ideal transport is that of a camera with four pixels a cell: the light of
// half pixels on the border of a cell is known only from the flood-lit photograph.
TEST(RegisteredProbe, captures_as_well_as_the_coaxial_rig) {
  const std::string scene = "sim:vgroove-textured?size=32x32&fine=4";
  const Registered bench = registered(scene + kBench);
  const auto ideal_rig = open_virtual_rig(scene);
  ASSERT_TRUE(ideal_rig.ok());
  const auto ideal = capture(**ideal_rig, {}), found = capture(*bench.probe, {});
  ASSERT_TRUE(ideal.ok() && found.ok());
  EXPECT_LE(static_cast<double>(found->patterns), 1.1 * static_cast<double>(ideal->patterns));
  const Scene& truth = bench.rig->truth();
  const auto error =
      evaluate(found->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return truth.apply(p); });
  ASSERT_TRUE(error.ok());
  EXPECT_LE(error->frobenius, 0.03);
}

// A bench whose photographs are looked at again and whose motion is watched takes the seconds that were
// forecast: within a factor of 1.5, as nine in ten captures (docs/research/error-per-second.md). A rig that
// is told nothing of what it will see takes 20 times as long for a photograph.
TEST(RegisteredProbe, photographs_aside_take_no_longer_than_others) {
  const auto rig = open_virtual_rig("sim:gummy?size=32x32&fine=4&camera=152x152&turn=1.5&zoom=0.784");
  ASSERT_TRUE(rig.ok()) << rig.error().line();
  const auto registration = register_camera(**rig);
  ASSERT_TRUE(registration.ok()) << registration.error().line();
  RegisteredProbe probe(**rig, *registration->weights(), registration->error());
  probe.watch_motion(registration->watch());
  std::int64_t aside = 0;
  CaptureOptions options;
  options.look_aside = [&](std::span<const Pattern> patterns, std::span<const Expectation> expected) {
    aside += std::ssize(patterns);
    return expected.empty() ? probe.measure(patterns) : probe.measure_expected(patterns, expected);
  };
  const double before = probe.cost().rig_seconds;
  const auto result = capture(probe, options);
  ASSERT_TRUE(result.ok()) << result.error().line();
  ASSERT_TRUE(result->forecast);
  EXPECT_GT(aside, 0);  // else this shows nothing
  EXPECT_LT(probe.cost().rig_seconds - before, 1.5 * result->forecast->rig_seconds);
}

// A rig that is off by a twenty-fifth of a cell, and whose registration says so, is not left to brute force.
// Without that it takes a third to a half more photographs (five seeds of the scene: 1.36 to 1.58 times as
// many): its direct light in neighbouring cells is no product of two pictures.
TEST(RegisteredProbe, a_map_that_is_known_to_be_wrong_is_not_left_to_brute_force) {
  const std::string scene =
      "sim:vgroove-textured?size=32x32&fine=4&camera=152x152&turn=1.5&zoom=0.784&distortion=0.02";
  const auto still = open_virtual_rig(scene + "&shift=3.3,-2.1"),
             moved = open_virtual_rig(scene + "&shift=3.34,-2.1");
  ASSERT_TRUE(still.ok() && moved.ok());
  const auto registration = register_camera(**still);
  ASSERT_TRUE(registration.ok()) << registration.error().line();
  const auto captured = [&](VirtualRig& rig, double map_error) {
    auto weights = registration->weights();
    EXPECT_TRUE(weights.ok());
    RegisteredProbe probe(rig, *std::move(weights), map_error);
    EXPECT_EQ(probe.residual_shift(), map_error);
    // The search is compared, without the checks that may follow it, and without photographs aside.
    CaptureOptions options;
    options.economy = default_economy(Algorithm::symrig);
    options.economy->check_share = 0;
    options.look_aside = [](auto, auto) { return std::vector<Radiance>(); };
    return capture(probe, options);
  };
  const auto at_rest = captured(**still, registration->error()), known = captured(**moved, 0.04),
             unknown = captured(**moved, 0);
  ASSERT_TRUE(at_rest.ok() && known.ok() && unknown.ok());
  EXPECT_LE(static_cast<double>(known->patterns), 1.3 * static_cast<double>(at_rest->patterns));
  EXPECT_GT(static_cast<double>(unknown->patterns), 1.5 * static_cast<double>(known->patterns));
  const auto error = evaluate(known->tensor, [&](const Image<float>& p) -> Result<Image<float>> {
    return (*moved)->truth().apply(p);
  });
  ASSERT_TRUE(error.ok() && known->estimated);
  // The estimates contain it, to the factor of 1.5 that they promise, or say why they are withheld.
  EXPECT_GT(known->estimated->frobenius, error->frobenius / 1.5);
  if (std::isfinite(known->estimated->indirect)) {
    EXPECT_GT(known->estimated->indirect, error->indirect / 1.5);
  } else {
    EXPECT_FALSE(known->estimate_not_given.empty());
  }
}

// The flood-lit photograph of a registration is the mean of many.
TEST(Registration, knows_the_flood_lit_scene_well) {
  const auto rig = open_virtual_rig(std::string("sim:vgroove-textured?size=32x32&black=0") + kBench);
  ASSERT_TRUE(rig.ok());
  const auto found = register_camera(**rig);
  ASSERT_TRUE(found.ok()) << found.error().line();
  EXPECT_EQ(found->cells, (Grid{32, 32}));
  EXPECT_EQ(found->camera(), (Grid{152, 152}));
  EXPECT_EQ(found->photographs, 2 * (5 + 5) + 2 + 6 + 2 + 16);
  EXPECT_NEAR(found->pixels_per_cell(), 152.0 / 32 * 0.784, 0.01);
  const Image<float> truth = (*rig)->ideal_photograph(Pattern({32, 32}, 1, 1.F));
  double square = 0, count = 0;
  for (std::size_t i = 0; i < truth.values().size(); ++i) {
    // All photographs share the error of one black photograph. It counts only beside the cells, where it is
    // dark.
    if (!found->flood.valid.values()[i] || truth.values()[i] < 0.05F) continue;
    square += std::pow(static_cast<double>(found->flood.mean.values()[i] - truth.values()[i]), 2) /
              static_cast<double>(found->flood.variance.values()[i]);
    count += 1;
  }
  // 1 ± √(2 / 14,000) if the variance is right; 4 % for the merge's own error of variance, as in the laws of
  // probes.
  EXPECT_NEAR(square / count, 1, 0.04 + 5 * std::sqrt(2 / count));
}

TEST(Registration, refuses_a_camera_that_is_too_coarse) {
  const auto rig = open_virtual_rig("sim:plane?size=32x32&fine=4&camera=48x48&turn=2");
  ASSERT_TRUE(rig.ok());
  const auto refused = register_camera(**rig);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::limit);
  EXPECT_NE(refused.error().line().find("1.5 times as large"), std::string::npos) << refused.error().line();
  RegistrationOptions forced;
  forced.least_pixels = 0;
  EXPECT_TRUE(register_camera(**rig, forced).ok());
}

// With a blur of three cells the map is wrong by half a cell, which two halves of the edges do not show.
TEST(Registration, refuses_a_picture_that_is_not_in_focus) {
  const auto rig =
      open_virtual_rig(std::string("sim:vgroove-textured?size=32x32&fine=2&defocus=0,3") + kBench);
  ASSERT_TRUE(rig.ok());
  const auto refused = register_camera(**rig);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_value);
  EXPECT_NE(refused.error().line().find("focus"), std::string::npos) << refused.error().line();
}

TEST(Registration, stops_when_asked) {
  const auto rig = open_virtual_rig(std::string("sim:plane?size=32x32") + kBench);
  ASSERT_TRUE(rig.ok());
  RegistrationOptions options;
  options.progress = [](const ProgressEvent& event) { return event.done < 3; };
  const auto stopped = register_camera(**rig, options);
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.error().code, ErrorCode::interrupted);
}

TEST(RegisteredProbe, a_rig_without_registration_is_refused) {
  const auto rig = open_virtual_rig(std::string("sim:plane?size=32x32") + kBench);
  ASSERT_TRUE(rig.ok());
  const auto result = capture(**rig, {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::size_mismatch);
  EXPECT_NE(result.error().line().find("152x152"), std::string::npos) << result.error().line();
  // The axis check compares pixels of both grids, so it must not begin.
  EXPECT_EQ(check_coaxial(**rig).error().code, ErrorCode::size_mismatch);
}

}  // namespace
}  // namespace symrig::registered_probe_test

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
