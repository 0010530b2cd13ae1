// SPDX-License-Identifier: Apache-2.0
#include "projector/drm/mode.hpp"

#include "assert_ok.hpp"
#include "fake_kms.hpp"

#include <gtest/gtest.h>

namespace symrig::projector::drm::test::mode_test {
namespace {

/// CTA-861 VIC 16: 148.5 MHz, 2200 x 1125.
drmModeModeInfo full_hd() {
  drmModeModeInfo mode = make_mode(1920, 1080, 60);
  mode.clock = 148'500;
  mode.htotal = 2200;
  mode.vtotal = 1125;
  return mode;
}

TEST(Mode, its_period_comes_from_its_timings) {
  EXPECT_EQ(describe(full_hd()).period, Nanoseconds(16'666'667));
  drmModeModeInfo ntsc = full_hd();
  ntsc.clock = 148'352;  // 148.5 MHz / 1.001
  EXPECT_EQ(to_string(describe(ntsc)), "1920x1080@59.94");
  EXPECT_EQ(to_string(describe(full_hd())), "1920x1080@60");
  drmModeModeInfo interlaced = full_hd();
  interlaced.flags = DRM_MODE_FLAG_INTERLACE;
  EXPECT_EQ(describe(interlaced).period, Nanoseconds(8'333'333));
  EXPECT_TRUE(describe(interlaced).interlaced);
  drmModeModeInfo untimed{};
  untimed.vrefresh = 50;
  EXPECT_EQ(describe(untimed).period, Nanoseconds(20'000'000));
}

TEST(Mode, requests_are_read_as_people_write_them) {
  const auto all = parse_mode("");
  ASSERT_OK(all);
  EXPECT_FALSE(all->grid || all->rate);
  const auto size = parse_mode("912x1140");
  ASSERT_OK(size);
  EXPECT_EQ(size->grid, (Grid{1140, 912}));
  const auto rate = parse_mode("1280x720@59.94");
  ASSERT_OK(rate);
  EXPECT_EQ(rate->rate, 59.94);
  for (const char* bad :
       {"1920", "1920x", "x1080", "1920x1080@", "1920x1080@0", "1920x1080@-60", "1920x1080@60Hz", "0x10",
        "-4x4", "1920X1080", " 1920x1080", "99999x99999", "1x1@nan", "1x1@inf"})
    EXPECT_EQ(parse_mode(bad).error().code, ErrorCode::bad_argument) << bad;
}

/// Against the modeline that `cvt -r` prints, an implementation of the standard that is not ours.
TEST(Mode, a_computed_one_has_the_timings_of_the_standard) {
  const auto wide = parse_mode("1920x1080R");
  ASSERT_OK(wide);
  const auto full = choose_mode({}, *wide, "card0-X-1");
  ASSERT_OK(full);
  EXPECT_EQ(full->clock, 138'500U);
  EXPECT_EQ(full->hsync_start, 1968);
  EXPECT_EQ(full->hsync_end, 2000);
  EXPECT_EQ(full->htotal, 2080);
  EXPECT_EQ(full->vsync_start, 1083);
  EXPECT_EQ(full->vsync_end, 1088);
  EXPECT_EQ(full->vtotal, 1111);
  EXPECT_EQ(to_string(describe(*full)), "1920x1080@59.93");
  const auto asked = parse_mode("912x1140R@60");
  ASSERT_OK(asked);
  const auto mode = choose_mode({}, *asked, "card0-X-1");
  ASSERT_OK(mode);
  EXPECT_EQ(describe(*mode).grid, (Grid{1140, 912}));
  EXPECT_NEAR(1 / seconds(describe(*mode).period), 60, 60 * 250. / mode->clock);
  EXPECT_FALSE(parse_mode("99999x10R").ok());
}

class Choice : public ::testing::Test {
 protected:
  std::string choose(const std::string& text) const {
    const auto request = parse_mode(text);
    EXPECT_TRUE(request.ok()) << text;
    const auto mode = choose_mode(modes, *request, "card0-X-1");
    return mode ? to_string(describe(*mode)) : std::string(name(mode.error().code));
  }
  std::vector<drmModeModeInfo> modes{make_mode(1920, 1080, 60, false, DRM_MODE_FLAG_INTERLACE),
                                     make_mode(1280, 720, 60, true),
                                     make_mode(1920, 1080, 120),
                                     make_mode(1920, 1080, 60),
                                     make_mode(1920, 1080, 59.94),
                                     make_mode(640, 480, 60, false, DRM_MODE_FLAG_DBLSCAN)};
};

TEST_F(Choice, follows_the_kernels_order) {
  EXPECT_EQ(choose(""), "1280x720@60");
  EXPECT_EQ(choose("1920x1080"), "1920x1080@120");
}

TEST_F(Choice, takes_the_nearest_rate_within_half_a_hertz) {
  EXPECT_EQ(choose("1920x1080@60"), "1920x1080@60");
  EXPECT_EQ(choose("1920x1080@59.94"), "1920x1080@59.94");
  EXPECT_EQ(choose("1920x1080@59.5"), "1920x1080@59.94");
  EXPECT_EQ(choose("1920x1080@50"), "unknown_name");
}

TEST_F(Choice, leaves_out_lines_that_are_not_the_projectors) {
  EXPECT_EQ(choose("640x480"), "unknown_name");
  modes.resize(1);
  EXPECT_EQ(choose("1920x1080"), "unknown_name");
  EXPECT_EQ(choose(""), "unknown_name");
  modes.clear();
  EXPECT_EQ(choose(""), "device_lost");
}

TEST_F(Choice, an_error_lists_what_there_is) {
  const auto mode = choose_mode(modes, {Grid{1, 1}, {}}, "card0-X-1");
  ASSERT_FALSE(mode.ok());
  EXPECT_EQ(mode.error().line(),
            "card0-X-1 has no mode 1x1; it has 1280x720@60, 1920x1080@120, 1920x1080@60, 1920x1080@59.94");
}

}  // namespace
}  // namespace symrig::projector::drm::test::mode_test
