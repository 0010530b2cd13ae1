// SPDX-License-Identifier: Apache-2.0

#include "assert_ok.hpp"
#include "fake_kms.hpp"
#include "symrig/projector/internal/drm.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <xf86drm.h>

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

namespace symrig::projector::drm::test::edid_test {
namespace {

/// An EDID block with one descriptor, at place 0 to 3, of this type and text.
std::vector<std::byte> edid(std::size_t place, unsigned char type, const std::string& text) {
  std::vector<std::byte> bytes(128);
  std::fill(bytes.begin() + 1, bytes.begin() + 7, std::byte{0xFF});
  const std::size_t at = 54 + 18 * place;
  bytes[at + 3] = std::byte{type};
  for (std::size_t k = 0; k < text.size(); ++k) bytes[at + 5 + k] = static_cast<std::byte>(text[k]);
  return bytes;
}

TEST(Edid, a_name_stands_in_any_descriptor) {
  for (std::size_t place = 0; place < 4; ++place)
    EXPECT_EQ(display_name(edid(place, 0xFC, "DLPC350\n     ")), "DLPC350");
  EXPECT_EQ(display_name(edid(1, 0xFC, "ThirteenChars")), "ThirteenChars");
}

TEST(Edid, what_is_no_name_is_none) {
  EXPECT_EQ(display_name(edid(0, 0xFE, "free text\n")), "");
  EXPECT_EQ(display_name({}), "");
  auto bytes = edid(0, 0xFC, "name\n");
  bytes[0] = std::byte{1};
  EXPECT_EQ(display_name(bytes), "");
  bytes = edid(0, 0xFC, "name\n");
  bytes.resize(127);
  EXPECT_EQ(display_name(bytes), "");
}

TEST(Edid, nothing_in_a_name_can_move_a_cursor) {
  EXPECT_EQ(display_name(edid(2, 0xFC, "a\x1b[2J\xC3\n")), "a?[2J?");
}

}  // namespace
}  // namespace symrig::projector::drm::test::edid_test

namespace symrig::projector::drm::test::hotplug_test {
namespace {

using namespace std::string_literals;

const std::string kPlug =
    "change@/devices/pci0000:00/0000:00:02.0/drm/card1\0ACTION=change\0SUBSYSTEM=drm\0HOTPLUG=1\0"
    "MAJOR=226\0MINOR=1\0DEVNAME=dri/card1\0DEVTYPE=drm_minor\0SEQNUM=2604\0"s;

std::string plug_with(const std::string& lines) {
  std::string text = kPlug;
  return text.append(lines);
}

TEST(Hotplug, a_plug_at_our_card_is_heard) {
  EXPECT_TRUE(is_hotplug_message(kPlug, "card1", 21));
  EXPECT_TRUE(is_hotplug_message(plug_with("CONNECTOR=21\0"s), "card1", 21));
}

TEST(Hotplug, what_is_not_ours_is_not) {
  EXPECT_FALSE(is_hotplug_message(kPlug, "card0", 21));
  EXPECT_FALSE(is_hotplug_message(kPlug, "card11", 21));
  EXPECT_FALSE(is_hotplug_message(plug_with("CONNECTOR=210\0"s), "card1", 21));
  EXPECT_FALSE(is_hotplug_message(plug_with("CONNECTOR=21\0PROPERTY=44\0"s), "card1", 21))
      << "content protection";
}

TEST(Hotplug, other_messages_are_passed_over) {
  EXPECT_FALSE(is_hotplug_message("", "card1", 21));
  EXPECT_FALSE(is_hotplug_message("add@/x\0ACTION=add\0SUBSYSTEM=drm\0DEVNAME=dri/card1"s, "card1", 21));
  EXPECT_FALSE(is_hotplug_message("change@/x\0SUBSYSTEM=usb\0HOTPLUG=1\0DEVNAME=dri/card1\0"s, "card1", 21));
}

}  // namespace
}  // namespace symrig::projector::drm::test::hotplug_test

namespace symrig::projector::drm::test::flip_events_test {
namespace {

/// A pipe in place of a card's file: what is written comes out as the kernel's events do.
class Events : public ::testing::Test {
 protected:
  Events() { EXPECT_EQ(pipe2(ends.data(), O_NONBLOCK | O_CLOEXEC), 0); }
  ~Events() override {
    close(ends[0]);
    if (ends[1] >= 0) close(ends[1]);
  }
  void send(const std::vector<std::byte>& bytes) const {
    ASSERT_EQ(write(ends[1], bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  static std::vector<std::byte> event(std::uint32_t type, std::uint64_t token, std::uint32_t sequence) {
    drm_event_vblank raw{};
    raw.base = {type, sizeof raw};
    raw.user_data = token;
    raw.tv_sec = 5;
    raw.tv_usec = 250'000;
    raw.sequence = sequence;
    std::vector<std::byte> bytes(sizeof raw);
    std::memcpy(bytes.data(), &raw, sizeof raw);
    return bytes;
  }
  KernelAnswer<FlipEvent> next(Nanoseconds patience = Nanoseconds{0}) {
    return events.next(ends[0], patience);
  }

  std::array<int, 2> ends{-1, -1};
  FlipEvents events;
};

TEST_F(Events, flips_come_out_in_order_with_their_stamps) {
  auto both = event(DRM_EVENT_FLIP_COMPLETE, 7, 41);
  const auto second = event(DRM_EVENT_FLIP_COMPLETE, 8, 42);
  both.insert(both.end(), second.begin(), second.end());
  send(both);
  const auto first = next();
  ASSERT_EQ(first.error, 0);
  EXPECT_EQ(first.value.token, 7U);
  EXPECT_EQ(first.value.sequence, 41U);
  EXPECT_EQ(first.value.stamp.since, Nanoseconds{5'250'000'000});
  EXPECT_EQ(next().value.token, 8U);
  EXPECT_EQ(next().error, ETIMEDOUT);
}

TEST_F(Events, other_kinds_are_passed_over) {
  send(event(DRM_EVENT_VBLANK, 1, 1));
  send(event(DRM_EVENT_FLIP_COMPLETE, 2, 2));
  EXPECT_EQ(next().value.token, 2U);
}

TEST_F(Events, an_event_of_impossible_length_is_an_error_and_not_read_past) {
  for (const std::uint32_t length : {0U, 7U, 4096U}) {
    const drm_event head{DRM_EVENT_FLIP_COMPLETE, length};
    std::vector<std::byte> bytes(sizeof head);
    std::memcpy(bytes.data(), &head, sizeof head);
    send(bytes);
    EXPECT_EQ(next().error, EPROTO) << length;
  }
}

TEST_F(Events, a_file_that_ends_is_a_card_that_is_gone) {
  close(ends[1]);
  ends[1] = -1;
  EXPECT_EQ(next(Nanoseconds{1'000'000'000}).error, ENODEV);
}

}  // namespace
}  // namespace symrig::projector::drm::test::flip_events_test
