// SPDX-License-Identifier: Apache-2.0
// A camera with a colour mosaic, registered: three channels on the projector's cells.
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/calibration/registered_probe.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "unit/calibration/filtered_probe.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::mosaic_cells_test {
namespace {

using tests::FilteredProbe, tests::kRggb, tests::Tint;

constexpr const char* kBench = "&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0.02";

struct Outcome {
  std::int64_t patterns;
  TransportErrors errors;
};

Outcome measured(Probe& rig, const Scene& truth) {
  const auto result = capture(rig, {});
  EXPECT_TRUE(result.ok()) << result.error().line();
  const auto errors =
      evaluate(result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return truth.apply(p); });
  return {result->patterns, *errors};
}

/// Red and blue have half the pixels along the side of a cell. So the bounds are those of a camera with as
/// many pixels: 0.22 / p on surfaces, within a factor of 1.5 (docs/research/registration.md). Patterns and
/// `frobenius` have the targets of a sharp bench there.
TEST(MosaicCells, are_captured_in_colour_with_the_patterns_of_the_coaxial_rig) {
  constexpr double kPixels = 152 * 0.784 / 32 / 2;
  const std::string uri = "sim:occluder?size=32x32&fine=2&channels=3";
  auto ideal = open_virtual_rig(uri), opened = open_virtual_rig(uri + kBench);
  ASSERT_TRUE(ideal.ok() && opened.ok());
  const Outcome coaxial = measured(**ideal, (*ideal)->truth());
  auto filtered = std::make_unique<FilteredProbe>(*std::move(opened));
  const auto registration = register_camera(*filtered);
  ASSERT_TRUE(registration.ok()) << registration.error().line();
  auto registered = RegisteredProbe::make(std::move(filtered), *registration, kRggb);
  ASSERT_TRUE(registered.ok()) << registered.error().line();
  EXPECT_EQ((*registered)->channels(), 3);
  (*registered)->watch_motion(registration->watch(Mosaic::rggb));
  const Outcome mosaic = measured(**registered, (*ideal)->truth());
  EXPECT_LE(static_cast<double>(mosaic.patterns), 1.15 * static_cast<double>(coaxial.patterns));
  EXPECT_LE(mosaic.errors.indirect, 1.5 * 0.22 / kPixels);
  EXPECT_LE(mosaic.errors.frobenius, 0.03);
}

Registration registered(const char* keys, const Tint& tint = {1, 1, 1}) {
  auto opened = open_virtual_rig(std::string("sim:vgroove-mixed?size=24x24&fine=2&channels=3") + keys);
  EXPECT_TRUE(opened.ok()) << opened.error().line();
  FilteredProbe rig(*std::move(opened), tint);
  auto found = register_camera(rig);
  EXPECT_TRUE(found.ok()) << found.error().line();
  return *std::move(found);
}

constexpr const char* kSmall = "&camera=128x128&turn=1.5&zoom=0.784&shift=3.3,-2.1";

/// In white light, for the cases that change only copies of it.
const Registration& white() {
  static const Registration found = registered(kSmall);
  return found;
}

TEST(MosaicCells, gather_each_colour_from_the_pixels_of_its_filter) {
  const Registration& found = white();
  const auto weights = found.weights_of_mosaic(kRggb);
  ASSERT_TRUE(weights.ok()) << weights.error().line();
  EXPECT_EQ(weights->channels(), 3);
  EXPECT_EQ(weights->camera_channels(), 1);
  const auto whole = weights->gather(found.flood);
  ASSERT_TRUE(whole.ok());
  for (int colour = 0; colour < 3; ++colour) {
    Radiance only = found.flood;  // what the other filters let through changes nothing
    for (int row = 0; row < only.mean.grid().rows; ++row)
      for (int col = 0; col < only.mean.grid().cols; ++col)
        if (kRggb.at(row, col) != colour) only.mean.at(row, col) = 1e6F;
    const auto cells = weights->gather(only);
    ASSERT_TRUE(cells.ok());
    EXPECT_TRUE(std::ranges::equal(cells->mean.plane(colour), whole->mean.plane(colour))) << colour;
    EXPECT_TRUE(std::ranges::equal(cells->valid.plane(colour), whole->valid.plane(colour))) << colour;
  }
}

constexpr Tint kRed{1, 0.1F, 0.1F};

/// The motion that a red scene's registration finds in a rig that is shifted by so many cells.
Motion motion_of_mosaic(const Registration& found, Mosaic filters, const char* shift) {
  auto opened = open_virtual_rig(
      std::string(
          "sim:vgroove-mixed?size=24x24&fine=2&channels=3&camera=128x128&turn=1.5&zoom=0.784&shift=") +
      shift);
  EXPECT_TRUE(opened.ok()) << opened.error().line();
  FilteredProbe rig(*std::move(opened), kRed);
  const auto motion = found.watch(filters).measure(rig);
  EXPECT_TRUE(motion.ok()) << motion.error().line();
  return motion.ok() ? *motion : Motion{};
}

// As Moved.is_measured_to_a_third. A pixel's neighbours have other filters. By their slopes, a red scene
// seems to move by a tenth: where red is bright, green has no edges, and where red has edges, green does not
// change.
TEST(MosaicCells, motion_is_found_by_the_pixels_of_each_colour) {
  const Registration found = registered(kSmall, kRed);
  const Motion still = motion_of_mosaic(found, Mosaic::rggb, "3.3,-2.1&seed=1");
  EXPECT_LT(still.distance(), 5 * still.sigma);
  for (const auto& [shift, row, col] :
       {std::tuple{"3.32,-2.1", 0.02, 0.0}, {"3.35,-2.1", 0.05, 0.0}, {"3.3,-2.12", 0.0, -0.02}}) {
    const double off = std::hypot(row, col);
    const Motion moved = motion_of_mosaic(found, Mosaic::rggb, shift);
    EXPECT_NEAR(moved.row, row, off / 3 + 5 * moved.sigma) << shift;
    EXPECT_NEAR(moved.col, col, off / 3 + 5 * moved.sigma) << shift;
    EXPECT_LT(motion_of_mosaic(found, Mosaic::none, shift).distance(), off / 2) << "the test would notice";
  }
}

TEST(MosaicCells, are_refused_where_another_filter_would_mix_the_colours) {
  Registration ghost = white();
  ghost.ghost.found = true;
  EXPECT_EQ(ghost.weights_of_mosaic(kRggb).error().code, ErrorCode::bad_argument);
  Registration blurred = white();
  blurred.blur = {.projector = 0.4, .camera = 0.1, .measured = true};
  EXPECT_EQ(blurred.weights_of_mosaic(kRggb).error().code, ErrorCode::bad_argument);
  const auto three = open_virtual_rig(std::string("sim:plane?size=24x24&channels=3") + kSmall);
  const auto colours = register_camera(**three);
  ASSERT_TRUE(colours.ok());
  EXPECT_EQ(colours->weights_of_mosaic(kRggb).error().code, ErrorCode::bad_argument);
}

}  // namespace
}  // namespace symrig::mosaic_cells_test
