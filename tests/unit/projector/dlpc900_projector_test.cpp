// SPDX-License-Identifier: Apache-2.0
// A screen whose pictures an emulated DLPC900 splits into bit planes.
#include "assert_ok.hpp"
#include "dlpc/emulated_dlpc900.hpp"
#include "drm_bench.hpp"
#include "projector/dlp/plane_projector.hpp"
#include "projector/dlpc900/video_planes.hpp"
#include "projector_laws.hpp"
#include "symrig/base/statistics.hpp"

#include <utility>

namespace symrig::projector::drm::test::dlpc900_projector_test {
namespace {

using dlp::PlaneProjector;
using symrig::test::EmulatedDlpc900;
using symrig::test::EmulatedTransport;

class Dlpc900Screen : public DrmBench {
 protected:
  Dlpc900Screen() {
    card->connectors[21].modes = {make_mode(1920, 1080, 60, true)};
    options.placement = {.cell = 120};
    sequence.lock_patience = sequence.mode_time = Nanoseconds{0};
    sequence.patience = Nanoseconds{40'000};
  }
  Result<std::unique_ptr<PlaneProjector>> open_planes() {
    auto screen = open();
    if (!screen) return screen.error();
    return PlaneProjector::open(
        *std::move(screen), planes,
        [this](const dlp::PictureSource& source) -> Result<std::unique_ptr<dlp::PlaneSequence>> {
          SYMRIG_TRY(auto begun,
                     dlpc900::VideoPlanes::begin(
                         dlpc900::Controller(std::make_unique<EmulatedTransport>(device)), source, sequence));
          return std::unique_ptr<dlp::PlaneSequence>(std::move(begun));
        });
  }

  std::shared_ptr<EmulatedDlpc900> device = std::make_shared<EmulatedDlpc900>();
  dlp::PlaneProjectorOptions planes;
  dlpc900::VideoPlaneOptions sequence;
};

TEST_F(Dlpc900Screen, keeps_the_laws_of_projectors) {
  const auto projector = open_planes();
  ASSERT_OK(projector);
  expect_projector_laws(**projector);
  const PlaneTiming timing = (*projector)->planes();
  EXPECT_EQ(timing.planes, 24);
  EXPECT_EQ(timing.period, Nanoseconds{683'000});
  EXPECT_EQ(timing.exposure, timing.period);
  EXPECT_EQ(timing.frame_lead, Nanoseconds{20'000});
}

// Plane k of the controller is the bit that its order says, read here from the scanned-out words by hand.
TEST_F(Dlpc900Screen, plane_k_is_the_bit_of_its_order) {
  planes.order = {{'R', 'G', 'B'}, true};
  const auto projector = open_planes();
  ASSERT_OK(projector);
  const Grid grid = (*projector)->grid();
  std::vector<Pattern> made(24, Pattern(grid));
  Random random(3);
  for (Pattern& pattern : made)
    for (float& value : pattern.values()) value = random.uniform() < 0.5 ? 0.F : 1.F;
  PlanePlan plan;
  for (int k = 0; k < 24; ++k) plan.push_back((5 * k) % 24);
  ASSERT_OK((*projector)->load_planes(made, {&plan, 1}));
  ASSERT_OK((*projector)->show(0));
  const auto words = card->scanned_out();
  int differing = 0;
  for (int k = 0; k < 24; ++k)
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col) {
        const auto word =
            words[static_cast<std::size_t>(120 * row + 7) * 1920 + static_cast<std::size_t>(120 * col + 9)];
        const bool lit = (word >> static_cast<unsigned>(23 - k) & 1U) != 0;  // R7 to R0, G7 to G0, B7 to B0
        differing +=
            lit != (made[static_cast<std::size_t>(plan[static_cast<std::size_t>(k)])].at(row, col) != 0);
      }
  EXPECT_EQ(differing, 0);
}

TEST_F(Dlpc900Screen, names_the_order_that_would_put_all_planes_in_their_places) {
  const auto projector = open_planes();
  ASSERT_OK(projector);
  std::vector<int> seen(24);
  for (int k = 0; k < 24; ++k) seen[static_cast<std::size_t>(k)] = k < 16 ? (k + 8) % 16 : k;
  EXPECT_EQ((*projector)->setting_for_planes(seen), "projector.plane_order = \"RGB\"");
  std::swap(seen[0], seen[1]);
  EXPECT_EQ((*projector)->setting_for_planes(seen), "");
  seen[0] = kBlackPlane;
  EXPECT_EQ((*projector)->setting_for_planes(seen), "");
}

TEST_F(Dlpc900Screen, controller_and_screen_are_left_as_they_were_found) {
  device->start_stored_patterns();
  const std::string before = device->state();
  {
    const auto projector = open_planes();
    ASSERT_OK(projector);
    EXPECT_TRUE(device->shows_sequence());
    ASSERT_EQ((*projector)->warnings().size(), 1U) << "its table is lost";
    device->reset();
    EXPECT_EQ((*projector)->check().error().code, ErrorCode::device_lost);
    device->start_stored_patterns();
  }
  EXPECT_EQ(device->state(), before);
  EXPECT_EQ(card->live_buffers, 0);
}

}  // namespace
}  // namespace symrig::projector::drm::test::dlpc900_projector_test
