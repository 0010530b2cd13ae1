// SPDX-License-Identifier: Apache-2.0
// A screen whose pictures an emulated DLPC350 splits into bit planes.
#include "assert_ok.hpp"
#include "dlpc/emulated_controller.hpp"
#include "fake_kms.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/projector/internal/dlpc350.hpp"
#include "symrig/projector/internal/planes.hpp"
#include "symrig/testing/projector_laws.hpp"

#include <cerrno>
#include <numeric>
#include <optional>
#include <utility>

namespace symrig::projector::drm::test::dlpc350_projector_test {
namespace {

using dlp::PlaneProjector;
using dlpc350::Controller;
using dlpc350::VideoPatterns;
using symrig::test::EmulatedDlpc350;
using symrig::test::EmulatedTransport;

class Dlpc350Screen : public DrmBench {
 protected:
  Dlpc350Screen() {
    card->connectors[21].modes = {make_mode(912, 1140, 60, true), make_mode(912, 1140, 120)};
    options.placement = {.cell = 57, .top = 3, .left = 5};
    sequence.lock_patience = Nanoseconds{0};
  }
  Result<std::unique_ptr<PlaneProjector>> open_planes() {
    auto screen = open();
    if (!screen) return screen.error();
    return PlaneProjector::open(
        *std::move(screen), planes,
        [this](const dlp::PictureSource& source) -> Result<std::unique_ptr<dlp::PlaneSequence>> {
          SYMRIG_TRY(auto patterns,
                     VideoPatterns::begin(Controller(std::make_unique<EmulatedTransport>(device)), source,
                                          sequence));
          return std::unique_ptr<dlp::PlaneSequence>(std::move(patterns));
        });
  }
  /// Random binary patterns.
  static std::vector<Pattern> random_patterns(Grid grid, std::size_t count) {
    std::vector<Pattern> made;
    Random random(7);
    for (std::size_t k = 0; k < count; ++k) {
      made.emplace_back(grid);
      for (float& value : made.back().values()) value = random.uniform() < 0.5 ? 0.F : 1.F;
    }
    return made;
  }
  /// The light of plane `plane` at a pattern's pixel, read from the scanned-out words as the guide numbers
  /// the planes: eight of green, of red, of blue, each from the lowest bit.
  float plane_at(const std::vector<std::uint32_t>& words, int plane, int row, int col) const {
    const Placement& at = options.placement;
    const std::int64_t cell = at.cell;
    const auto index = static_cast<std::size_t>((at.top + cell * row + 11) * 912 + at.left + cell * col + 13);
    const int shift = plane < 8 ? 8 + plane : plane < 16 ? plane + 8 : plane - 16;
    return static_cast<float>(words[index] >> static_cast<unsigned>(shift) & 1U);
  }
  /// How many pixels of a plane differ from a pattern; nullptr: from black. words: of the scanned-out
  /// picture.
  int differing(const std::vector<std::uint32_t>& words, int plane, const Pattern* pattern, Grid grid) const {
    int count = 0;
    for (int row = 0; row < grid.rows; ++row)
      for (int col = 0; col < grid.cols; ++col)
        count += plane_at(words, plane, row, col) != (pattern == nullptr ? 0.F : pattern->at(row, col));
    return count;
  }

  std::shared_ptr<EmulatedDlpc350> device = std::make_shared<EmulatedDlpc350>();
  dlp::PlaneProjectorOptions planes;
  dlpc350::VideoPatternOptions sequence;
};

TEST_F(Dlpc350Screen, keeps_the_laws_of_projectors) {
  const auto projector = open_planes();
  ASSERT_OK(projector);
  expect_projector_laws(**projector);
}

TEST_F(Dlpc350Screen, plane_k_of_picture_f_is_the_planned_pattern) {
  const auto opened = open_planes();
  ASSERT_OK(opened);
  PlaneProjector& projector = **opened;
  const auto made = random_patterns(projector.grid(), 60);
  std::vector<PlanePlan> plans(3, PlanePlan(24));
  for (int f = 0; f < 3; ++f)
    for (int k = 0; k < 24; ++k)
      plans[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)] = (24 * f + 7 * k) % 60;
  plans[2].resize(5);  // 19 planes are left
  plans[2][3] = kBlackPlane;
  ASSERT_OK(projector.load_planes(made, plans));
  for (const std::size_t f : {0U, 2U, 1U, 0U}) {
    ASSERT_OK(projector.show(f));
    const auto words = card->scanned_out();
    for (int k = 0; k < 24; ++k) {
      const int pattern =
          static_cast<std::size_t>(k) < plans[f].size() ? plans[f][static_cast<std::size_t>(k)] : kBlackPlane;
      EXPECT_EQ(
          differing(words, k, pattern == kBlackPlane ? nullptr : &made[static_cast<std::size_t>(pattern)],
                    projector.grid()),
          0)
          << "plane " << k << " of picture " << f;
    }
  }
}

/// A screen that plays pictures.
class PlayingScreen : public Dlpc350Screen {
 protected:
  void SetUp() override {
    auto opened = open_planes();
    ASSERT_OK(opened);
    projector = *std::move(opened);
    made = random_patterns(projector->grid(), kPictures);
    std::vector<PlanePlan> plans;
    plans.reserve(kPictures);
    for (int f = 0; f < static_cast<int>(kPictures); ++f) plans.emplace_back(24, f);
    ASSERT_OK(projector->load_planes(made, plans));
    for (std::size_t f = 0; f < kPictures; ++f) order.push_back(f);
  }
  std::vector<ShownPicture> play() {
    const auto first = projector->play(order);
    EXPECT_TRUE(first.ok()) << (first.ok() ? "" : first.error().line());
    if (!first) return {};
    auto shown = projector->played();
    EXPECT_TRUE(shown.ok()) << (shown.ok() ? "" : shown.error().line());
    if (!shown || shown->empty()) return {};
    EXPECT_EQ(shown->front().shown.refresh, first->refresh);
    EXPECT_EQ(shown->front().shown.since, first->since);
    return *std::move(shown);
  }

  static constexpr std::size_t kPictures = 12;
  std::unique_ptr<PlaneProjector> projector;
  std::vector<Pattern> made;
  std::vector<std::size_t> order;
  std::optional<SteadyTime> slept;
};

TEST_F(PlayingScreen, each_refresh_has_its_picture) {
  order.insert(order.begin() + 4, 3, 3);  // picture 3 stays for four refreshes
  std::vector<int> wrong;                 // pixels, in each refresh
  card->on_delivery = [&] {
    wrong.push_back(differing(card->scanned_out(), 7, &made[order[wrong.size()]], projector->grid()));
  };
  const auto shown = play();
  ASSERT_EQ(shown.size(), order.size());
  EXPECT_EQ(wrong, std::vector<int>(order.size(), 0));
  for (std::size_t k = 0; k < order.size(); ++k) {
    EXPECT_EQ(shown[k].picture, order[k]);
    EXPECT_EQ(shown[k].shown.refresh, shown[0].shown.refresh + k);
  }
}

// A request takes 20 ms: one refresh shows the picture before.
TEST_F(PlayingScreen, a_late_picture_is_the_one_of_the_refresh_in_which_it_comes) {
  const std::uint64_t begin = card->flips;
  card->on_flip = [this, begin](std::uint64_t flip) -> Errno {
    if (flip == begin + 4) card->time = card->time + Nanoseconds{20'000'000};
    return 0;
  };
  const auto shown = play();
  ASSERT_EQ(shown.size(), kPictures - 1);
  // The fourth request was made for picture 3, and came a refresh late: picture 3 is there in place of 4.
  EXPECT_EQ(shown[3].picture, 3U);
  EXPECT_EQ(shown[3].shown.refresh, shown[0].shown.refresh + 4);
  for (std::size_t k = 4; k < shown.size(); ++k) {
    EXPECT_EQ(shown[k].picture, k + 1) << "its own refresh again";
    EXPECT_EQ(shown[k].shown.refresh, shown[0].shown.refresh + k + 1);
  }
}

// The thread sleeps for two refreshes between a flip and its next request: it then requests the picture of
// the refresh that comes.
TEST_F(PlayingScreen, a_thread_that_sleeps_leaves_pictures_out) {
  const std::uint64_t begin = card->flips;
  card->on_event = [this, begin](std::uint64_t flip, FlipEvent& event) {
    if (flip == begin + 3) slept = event.stamp + Nanoseconds{36'000'000};
  };
  card->on_delivery = [this] {
    if (slept) card->time = *std::exchange(slept, std::nullopt);
  };
  const auto shown = play();
  ASSERT_EQ(shown.size(), kPictures - 2);
  EXPECT_EQ(shown[2].picture, 2U);
  EXPECT_EQ(shown[3].picture, 5U);
  EXPECT_EQ(shown[3].shown.refresh, shown[0].shown.refresh + 5);
}

TEST_F(PlayingScreen, a_screen_that_goes_is_told_at_the_end) {
  const std::uint64_t begin = card->flips;
  card->on_flip = [this, begin](std::uint64_t flip) -> Errno {
    card->gone = flip >= begin + 5;
    return card->gone ? ENODEV : 0;
  };
  ASSERT_OK(projector->play(order));
  const auto shown = projector->played();
  ASSERT_FALSE(shown.ok());
  EXPECT_EQ(shown.error().code, ErrorCode::device_lost);
  EXPECT_EQ(projector->show(0).error().code, ErrorCode::device_lost) << "until it is opened again";
}

TEST_F(PlayingScreen, a_projector_may_be_destroyed_while_it_plays) {
  order.insert(order.end(), 1000, 0);
  ASSERT_OK(projector->play(order));
  projector.reset();
  EXPECT_EQ(card->live_buffers, 0);
}

TEST_F(PlayingScreen, wrong_calls_are_refused) {
  EXPECT_EQ(projector->played().error().code, ErrorCode::bad_argument);
  EXPECT_EQ(projector->play({}).error().code, ErrorCode::bad_argument);
  order.back() = kPictures;
  EXPECT_EQ(projector->play(order).error().code, ErrorCode::bad_argument);
}

TEST_F(Dlpc350Screen, a_screen_without_a_count_of_refreshes_is_refused_before_light) {
  card->counts = false;
  const std::string before = device->state();
  EXPECT_EQ(open_planes().error().code, ErrorCode::device_refused);
  EXPECT_EQ(device->state(), before);
}

TEST_F(Dlpc350Screen, nothing_but_0_and_1_fits_into_a_plane) {
  const auto projector = open_planes();
  ASSERT_OK(projector);
  std::vector<Pattern> made(1, Pattern((*projector)->grid(), 1, 0.5F));
  const std::vector<PlanePlan> plans{{0}};
  EXPECT_EQ((*projector)->load_planes(made, plans).error().code, ErrorCode::bad_value);
  made[0] = Pattern((*projector)->grid(), 1, 1.F);
  ASSERT_OK((*projector)->load_planes(made, plans));
  for (const PlanePlan& wrong : {PlanePlan{1}, PlanePlan{-2}, PlanePlan(25, 0)})
    EXPECT_EQ((*projector)->load_planes(made, {&wrong, 1}).error().code, ErrorCode::bad_argument);
}

TEST_F(Dlpc350Screen, grey_is_a_number_of_bright_planes) {
  const auto projector = open_planes();
  ASSERT_OK(projector);
  for (const int level : {0, 1, 5, 12, 23, 24}) {
    const std::vector<Pattern> made(1, Pattern((*projector)->grid(), 1, static_cast<float>(level) / 24.F));
    ASSERT_OK((*projector)->load(made));
    ASSERT_OK((*projector)->show(0));
    const auto words = card->scanned_out();
    int bright = 0;
    for (int k = 0; k < 24; ++k) bright += differing(words, k, nullptr, (*projector)->grid()) > 0;
    EXPECT_EQ(bright, level);
  }
}

TEST_F(Dlpc350Screen, tells_its_planes) {
  sequence.planes = 12;
  sequence.period_us = 1300;
  sequence.exposure_us = 1000;
  planes.latency = 2;
  const auto projector = open_planes();
  ASSERT_OK(projector);
  const PlaneTiming timing = (*projector)->planes();
  EXPECT_EQ(timing.planes, 12);
  EXPECT_EQ(timing.period, Nanoseconds{1'300'000});
  EXPECT_EQ(timing.exposure, Nanoseconds{1'000'000});
  EXPECT_EQ(timing.frame_lead, Nanoseconds{20'000});
  EXPECT_EQ(timing.latency, 2);
  const std::string text = (*projector)->describe();
  EXPECT_NE(text.find("firmware 3.1.0, 12 planes of 1300 us"), std::string::npos) << text;
}

TEST_F(Dlpc350Screen, a_mode_of_120_hz_has_shorter_planes_and_the_source_must_have_it) {
  options.mode = "912x1140@120";
  EXPECT_EQ(open_planes().error().code, ErrorCode::device_refused) << "the cable brings 60 Hz";
  device->hertz = 120;
  const auto projector = open_planes();
  ASSERT_OK(projector);
  EXPECT_EQ((*projector)->planes().period, Nanoseconds{337'000});
}

TEST_F(Dlpc350Screen, controller_and_screen_are_left_as_they_were_found) {
  const std::string before = device->state();
  {
    const auto projector = open_planes();
    ASSERT_OK(projector);
    EXPECT_TRUE(device->shows_sequence());
    EXPECT_NE(device->state(), before);
  }
  EXPECT_EQ(device->state(), before);
  EXPECT_EQ(card->live_buffers, 0);
  device->hertz = 50;
  EXPECT_FALSE(open_planes().ok());
  EXPECT_EQ(device->state(), before);
  EXPECT_EQ(card->live_buffers, 0);
}

TEST_F(Dlpc350Screen, a_reset_controller_is_lost) {
  const auto projector = open_planes();
  ASSERT_OK(projector);
  ASSERT_OK((*projector)->check());
  device->reset();
  EXPECT_EQ((*projector)->check().error().code, ErrorCode::device_lost);
}

}  // namespace
}  // namespace symrig::projector::drm::test::dlpc350_projector_test
