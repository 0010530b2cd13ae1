// SPDX-License-Identifier: Apache-2.0
#include "assert_ok.hpp"
#include "fake_kms.hpp"
#include "symrig/projector/internal/drm.hpp"
#include "symrig/testing/projector_laws.hpp"

namespace symrig::projector::drm::test::drm_projector_test {
namespace {

/// Both ways of driving a card, with two and with three buffers.
struct Way {
  bool atomic;
  int buffers;
};

class Ways : public DrmBench, public ::testing::WithParamInterface<Way> {
 protected:
  Ways() {
    card->has_atomic = GetParam().atomic;
    options.buffers = GetParam().buffers;
  }
};

TEST_P(Ways, what_is_scanned_out_is_the_pattern) {
  options.placement = {.cell = 3, .top = 5, .left = 7, .mirror_rows = true};
  const auto projector = opened();
  ASSERT_TRUE(projector);
  EXPECT_EQ(projector->screen(), (Grid{48, 64}));
  EXPECT_EQ(projector->grid(), (Grid{14, 19}));
  for (const std::size_t k : {0, 1, 2, 2, 2, 4, 3, 0, 4, 1, 1}) {
    ASSERT_OK(projector->show(k));
    ASSERT_EQ(card->scanned_out(), wanted(*projector, k)) << k;
  }
}

TEST_P(Ways, a_screen_keeps_the_laws_of_projectors) {
  const auto projector = opened();
  ASSERT_TRUE(projector);
  expect_projector_laws(*projector);
}

TEST_P(Ways, a_refresh_is_told_by_its_number_and_its_beginning) {
  const auto projector = opened();
  ASSERT_TRUE(projector);
  auto before = projector->show(0);
  ASSERT_OK(before);
  for (std::size_t k = 1; k < 100; ++k) {
    if (k % 7 == 0) card->time = card->time + Nanoseconds(40'000'000);  // two or three refreshes are missed
    const auto shown = projector->show(k % 5);
    ASSERT_OK(shown);
    EXPECT_TRUE(shown->counted);
    const auto refreshes = static_cast<std::int64_t>(shown->refresh - before->refresh);
    EXPECT_EQ(shown->since - before->since, refreshes * projector->refresh_period());
    EXPECT_EQ(refreshes > 1, k % 7 == 0) << refreshes;
    EXPECT_GE(card->time, shown->since) << "its first refresh has begun";
    before = shown;
  }
}

TEST_P(Ways, the_screen_is_black_until_the_first_pattern) {
  const auto projector = open();
  ASSERT_OK(projector);
  EXPECT_EQ(card->scanned_out(), std::vector<std::uint32_t>(48UL * 64, 0U));
}

TEST_P(Ways, the_screen_is_given_back_and_nothing_is_left) {
  const std::uint32_t console = 500;
  card->memory_of[console].assign(64UL * 48, 0x123456U);
  card->pitch_of[console] = 64;
  card->crtcs[11].mode = make_mode(40, 30, 60);
  card->crtcs[11].fb = console;
  card->connectors[21].crtc = 11;
  card->add_property(21, {.name = "max bpc", .value = 12, .range = {{6, 16}}});
  card->add_property(11, {.name = "GAMMA_LUT", .value = 600, .blob = true});
  card->blobs[600] = {std::byte{1}, std::byte{2}};
  const std::size_t blobs = card->blobs.size();
  {
    const auto projector = opened();
    ASSERT_TRUE(projector);
    ASSERT_OK(projector->show(0));
    EXPECT_EQ(card->property(21, "max bpc").value, 8U);
    EXPECT_EQ(card->property(11, "GAMMA_LUT").value, 0U);
    card->blobs.erase(600);  // its owner has gone meanwhile
  }
  EXPECT_EQ(card->crtcs[11].fb, console);
  EXPECT_EQ(card->crtcs[11].mode->hdisplay, 40);
  EXPECT_EQ(card->property(21, "max bpc").value, 12U);
  EXPECT_NE(card->property(11, "GAMMA_LUT").value, 0U);
  EXPECT_EQ(card->live_buffers, 0);
  EXPECT_EQ(card->blobs.size(), blobs - 1);
  EXPECT_EQ(card->open_files, 0);
  EXPECT_EQ(card->masters, 0);
}

TEST_P(Ways, a_driver_that_counts_no_refreshes_is_found_out) {
  card->counts = false;
  const auto projector = opened();
  ASSERT_TRUE(projector);
  EXPECT_FALSE(projector->counts_refreshes());
  ASSERT_EQ(projector->warnings().size(), 1U);
  EXPECT_NE(projector->warnings()[0].find("does not count refreshes"), std::string::npos);
  const auto first = projector->show(0), second = projector->show(1);
  ASSERT_OK(first);
  ASSERT_OK(second);
  EXPECT_FALSE(first->counted);
  EXPECT_EQ(second->refresh, first->refresh + 1);
  EXPECT_NE(projector->describe().find("not counted"), std::string::npos) << projector->describe();
}

TEST_P(Ways, a_driver_whose_count_is_not_that_of_its_mode_is_found_out) {
  card->on_event = [](std::uint64_t flip, FlipEvent& event) {
    event.stamp = event.stamp + static_cast<std::int64_t>(flip) * Nanoseconds(7'000'000);
  };
  const auto projector = opened();
  ASSERT_TRUE(projector);
  EXPECT_FALSE(projector->counts_refreshes());
  ASSERT_EQ(projector->warnings().size(), 1U);
  EXPECT_NE(projector->warnings()[0].find("do not agree"), std::string::npos) << projector->warnings()[0];
}

TEST_P(Ways, an_event_ahead_of_its_refresh_is_waited_for) {
  card->early = Nanoseconds(700'000);
  const auto projector = opened();
  ASSERT_TRUE(projector);
  for (std::size_t k = 0; k < 5; ++k) {
    const auto shown = projector->show(k);
    ASSERT_OK(shown);
    EXPECT_GE(card->time, shown->since);
  }
}

TEST_P(Ways, the_kernels_count_may_overflow) {
  card->sequence_offset = 0xFFFF'FFFFU - 70;  // the clock begins 60 refreshes after 0
  const auto projector = opened();
  ASSERT_TRUE(projector);
  std::uint64_t before = 0;
  for (std::size_t k = 0; k < 30; ++k) {
    const auto shown = projector->show(k % 5);
    ASSERT_OK(shown);
    if (k > 0) {
      EXPECT_EQ(shown->refresh, before + 1);
    }
    before = shown->refresh;
  }
  EXPECT_GT(before, 0xFFFF'FFFFULL);
}

INSTANTIATE_TEST_SUITE_P(All, Ways,
                         ::testing::Values(Way{true, 3}, Way{true, 2}, Way{false, 3}, Way{false, 2}),
                         [](const auto& way) {
                           return std::string(way.param.atomic ? "atomic" : "legacy") +
                                  std::to_string(way.param.buffers);
                         });

TEST_F(DrmBench, a_card_with_memory_for_two_pictures_does_with_two) {
  card->memory = 2;
  const auto projector = opened();
  ASSERT_TRUE(projector);
  for (std::size_t k = 0; k < 5; ++k) {
    ASSERT_OK(projector->show(k));
    EXPECT_EQ(card->scanned_out(), wanted(*projector, k));
  }
}

TEST_F(DrmBench, legacy_can_be_asked_for) {
  options.legacy = true;
  const auto projector = opened();
  ASSERT_TRUE(projector);
  ASSERT_OK(projector->show(3));
  EXPECT_EQ(card->scanned_out(), wanted(*projector, 3));
  EXPECT_EQ(card->property(31, "FB_ID").value, 0U) << "no atomic commit has been made";
}

TEST_F(DrmBench, a_mode_can_be_asked_for) {
  options.mode = "40x30@60";
  const auto projector = opened(1);
  ASSERT_TRUE(projector);
  EXPECT_EQ(projector->screen(), (Grid{30, 40}));
  EXPECT_EQ(projector->describe(), "card0-HDMI-A-1 (fake) 40x30@60, patterns 30x40 in cells of 1");
}

TEST_F(DrmBench, cursor_and_overlays_are_off) {
  const auto atomic = opened();
  ASSERT_TRUE(atomic);
  EXPECT_EQ(card->property(32, "FB_ID").value, 0U);
  EXPECT_EQ(card->property(32, "CRTC_ID").value, 0U);
}

TEST_F(DrmBench, patterns_must_be_loaded_and_fit) {
  const auto projector = opened(2);
  ASSERT_TRUE(projector);
  EXPECT_EQ(projector->show(2).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(projector->load(std::vector<Pattern>{Pattern({1, 1})}).error().code, ErrorCode::size_mismatch);
  auto dark = patterns(projector->grid(), 1);
  dark[0].at(0, 0) = -1;
  EXPECT_EQ(projector->load(dark).error().code, ErrorCode::bad_value);
  ASSERT_OK(projector->show(1));
  EXPECT_EQ(card->scanned_out(), wanted(*projector, 1)) << "a refused load() changes nothing";
}

TEST_F(DrmBench, a_new_load_does_not_show_what_was_drawn_before) {
  const auto projector = opened(3);
  ASSERT_TRUE(projector);
  ASSERT_OK(projector->show(0));  // pattern 1 is drawn ahead
  const Pattern white(projector->grid(), 1, 1.F);
  ASSERT_OK(projector->load(std::vector<Pattern>{white, white}));
  ASSERT_OK(projector->show(1));
  EXPECT_EQ(card->scanned_out(), std::vector<std::uint32_t>(48UL * 64, 0xFFFFFFU));
}

TEST_F(DrmBench, displays_are_listed) {
  card->blobs[700] = std::vector<std::byte>(128);
  card->add_property(21, {.name = "EDID", .value = 700, .blob = true});
  card->connectors[22] = {22, "DP-1", false, {}, 1, 0};
  const auto displays = find_displays(cards);
  ASSERT_EQ(displays.size(), 2U);
  EXPECT_EQ(displays[0].connector, "card0-HDMI-A-1");
  EXPECT_EQ(displays[0].driver, "fake");
  EXPECT_TRUE(displays[0].connected);
  ASSERT_EQ(displays[0].modes.size(), 3U);
  EXPECT_TRUE(displays[0].modes[0].preferred);
  EXPECT_FALSE(displays[1].connected);
  EXPECT_EQ(card->masters, 0) << "looking takes no screen from anybody";
  EXPECT_EQ(card->open_files, 0);
  cards.unopenable.emplace("card0", Error{ErrorCode::device_lost, "card0: no permission", "ask"});
  const auto locked = find_displays(cards);
  ASSERT_EQ(locked.size(), 1U);
  EXPECT_EQ(locked[0].error, "card0: no permission; ask");
  cards.unopenable.at("card0").code = ErrorCode::device_refused;
  EXPECT_TRUE(find_displays(cards).empty()) << "a card that only computes is no projector";
}

}  // namespace
}  // namespace symrig::projector::drm::test::drm_projector_test
