// SPDX-License-Identifier: Apache-2.0
// A simulated bench whose camera has pixels of its own, with the exact map: what a perfect calibration would
// give.
#include "symrig/calibration/registered_probe.hpp"

#include "../rig/probe_laws.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <memory>
#include <string>

#include <gtest/gtest.h>

namespace symrig::registered_probe_test {
namespace {

/// Four camera pixels along the side of a cell at zoom 1, and a margin on all sides.
constexpr const char* kBench = "&camera=152x152&turn=1.5&zoom=0.784&shift=3.3,-2.1&distortion=0.02";

struct Registered {
  std::unique_ptr<VirtualRig> rig;
  std::unique_ptr<RegisteredProbe> probe;
};

/// Registers a rig with its exact map and one flood-lit photograph.
Registered registered(const std::string& uri) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << rig.error().line();
  const Pattern white((*rig)->grid(), 1, 1.F);
  const auto flood = (*rig)->measure({&white, 1});
  EXPECT_TRUE(flood.ok()) << flood.error().line();
  const auto corners = (*rig)->exact_corners();
  auto weights = CellWeights::make((*rig)->grid(), corners, flood->front());
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
  const Registered bench = registered(std::string("sim:plane?size=32x32&channels=3") + kBench);
  EXPECT_EQ(bench.rig->camera_grid(), (Grid{152, 152}));
  EXPECT_EQ(bench.probe->grid(), (Grid{32, 32}));
  EXPECT_EQ(bench.probe->camera_grid(), bench.probe->grid());
  EXPECT_TRUE(check_aligned(*bench.probe).ok());
  EXPECT_EQ(bench.probe->channels(), 3);
  const Pattern white({32, 32}, 1, 1.F);
  const auto photographs = bench.probe->measure({&white, 1});
  ASSERT_TRUE(photographs.ok());
  EXPECT_EQ(photographs->front().mean.grid(), (Grid{32, 32}));
  EXPECT_EQ(photographs->front().mean.channels(), 3);
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

TEST(RegisteredProbe, a_rig_without_registration_is_refused) {
  const auto rig = open_virtual_rig(std::string("sim:plane?size=32x32") + kBench);
  ASSERT_TRUE(rig.ok());
  const auto result = capture(**rig, {});
  ASSERT_FALSE(result.ok());
  EXPECT_EQ(result.error().code, ErrorCode::size_mismatch);
  EXPECT_NE(result.error().line().find("152x152"), std::string::npos) << result.error().line();
}

}  // namespace
}  // namespace symrig::registered_probe_test
