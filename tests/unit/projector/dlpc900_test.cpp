// SPDX-License-Identifier: Apache-2.0
// The commands of a DLPC900 and its video-pattern mode, against an emulated controller.

#include "symrig/projector/internal/dlpc900.hpp"

#include "assert_ok.hpp"
#include "dlpc/emulated_controller.hpp"
#include "fake_kms.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/projector/internal/planes.hpp"
#include "symrig/testing/projector_laws.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::test::dlpc900_test {
namespace {

using namespace projector::dlpc900;
using projector::dlp::Bytes;
using projector::dlp::LedCurrents;
using projector::dlp::LedEnable;
using projector::dlp::longest_period;
using projector::dlp::PictureSource;
using projector::dlp::Run;
using projector::dlp::Sequence;

constexpr PictureSource kScreen{{1080, 1920}, Nanoseconds{16'666'667}};

class Dlpc900 : public ::testing::Test {
 protected:
  Dlpc900() {
    options.lock_patience = options.mode_time = Nanoseconds{0};
    options.patience = Nanoseconds{40'000};
  }
  Controller controller() const { return Controller(std::make_unique<EmulatedTransport>(device)); }
  Result<std::unique_ptr<VideoPlanes>> begin() { return VideoPlanes::begin(controller(), source, options); }
  /// Begins, and expects a refusal before any sequence ran. The controller is then as it was found.
  Error refusal() {
    const std::string before = device->state();
    const auto begun = begin();
    EXPECT_FALSE(begun.ok());
    EXPECT_EQ(device->sequences_started(), 0) << "no light before a refusal";
    EXPECT_EQ(device->state(), before);
    return begun ? Error{ErrorCode::fault, "none"} : begun.error();
  }

  std::shared_ptr<EmulatedDlpc900> device = std::make_shared<EmulatedDlpc900>();
  PictureSource source = kScreen;
  VideoPlaneOptions options;
};

// Entry 1 of the guide's example of a video-pattern sequence (DLPU018J, table 5-1): bit 1, 400 us, green, 2
// bits, no wait; and its entry 0: 200 us, red, 1 bit, waits.
TEST(Dlpc900Table, entries_are_the_bytes_of_the_guides_example) {
  EXPECT_EQ(to_bytes({.index = 0, .exposure_us = 200, .leds = 1, .waits = true}),
            (Bytes{0x00, 0x00, 0xC8, 0x00, 0x00, 0x90, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00}));
  EXPECT_EQ(to_bytes({.index = 1, .exposure_us = 400, .bits = 2, .leds = 2, .bit = 1}),
            (Bytes{0x01, 0x00, 0x90, 0x01, 0x00, 0x22, 0x00, 0x00, 0x00, 0x00, 0x00, 0x08}));
  EXPECT_EQ(to_bytes({.index = 258,
                      .exposure_us = 0x030201,
                      .clears = true,
                      .dark_us = 0x060504,
                      .no_trigger_2 = true,
                      .bit = 23}),
            (Bytes{0x02, 0x01, 0x01, 0x02, 0x03, 0x71, 0x04, 0x05, 0x06, 0x01, 0x00, 0xB8}));
}

TEST(Dlpc900Table, vsync_begins_a_video_sequence_and_each_plane_has_a_pulse) {
  const auto table = video_table({24, 683, 683, 7});
  ASSERT_EQ(table.size(), 24U);
  for (std::size_t k = 0; k < table.size(); ++k) {
    EXPECT_EQ(table[k].index, static_cast<int>(k));
    EXPECT_EQ(table[k].bit, static_cast<int>(k));
    EXPECT_EQ(table[k].waits, k == 0);
    EXPECT_EQ(table[k].clears, k == 23);
    EXPECT_EQ(table[k].exposure_us, 683U);
    EXPECT_EQ(table[k].dark_us, 0U);
    EXPECT_FALSE(table[k].no_trigger_2);
  }
}

TEST(Dlpc900Limits, the_longest_period_leaves_250_us_before_vsync) {
  for (const int hertz : {60, 120}) {
    const Nanoseconds refresh{1'000'000'000 / hertz};
    const auto period = longest_period(24, refresh, kPlaneLimits);
    ASSERT_OK(period);
    EXPECT_LE(24. * *period + 250, 0.999e-3 * static_cast<double>(refresh.count()));
    EXPECT_GT(24. * (*period + 1) + 250, 0.999e-3 * static_cast<double>(refresh.count()));
  }
  EXPECT_EQ(longest_period(24, Nanoseconds{2'500'000}, kPlaneLimits).error().code, ErrorCode::limit);
}

TEST(Dlpc900Limits, delays_are_whole_microseconds_in_the_range_of_the_guide) {
  EXPECT_EQ(*delay_us(Nanoseconds{-20'000}), -20);
  EXPECT_EQ(*delay_us(Nanoseconds{1'499}), 1);
  EXPECT_EQ(*delay_us(Nanoseconds{20'000'000}), 20'000);
  EXPECT_EQ(delay_us(Nanoseconds{-20'600}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(delay_us(Nanoseconds{20'000'600}).error().code, ErrorCode::bad_argument);
}

TEST_F(Dlpc900, what_can_be_read_is_read_as_it_was_written) {
  Controller c = controller();
  EXPECT_EQ(projector::dlp::to_string(*c.version()), "6.0.1");
  ASSERT_OK(c.set_trigger_out(1, {true, -20, 300}));
  EXPECT_EQ(*c.trigger_out(1), (TriggerOut{true, -20, 300}));
  EXPECT_EQ(device->setting(0x1A1D), (Bytes{1, 0xEC, 0xFF, 0x2C, 0x01})) << "signed, low byte first";
  ASSERT_OK(c.set_counts({24, 0}));
  EXPECT_EQ(*c.counts(), (Counts{24, 0}));
  ASSERT_OK(c.set_receiver(2));
  EXPECT_EQ(*c.receiver(), 2);
  ASSERT_OK(c.set_led_enable({5, false}));
  EXPECT_EQ(*c.led_enable(), (LedEnable{5, false}));
  ASSERT_OK(c.set_led_currents({1, 2, 3}));
  EXPECT_EQ(*c.led_currents(), (LedCurrents{1, 2, 3}));
}

// The emulated controller refuses to tell its table, as the guide has it: nothing of the driver may ask.
TEST_F(Dlpc900, the_table_is_really_not_readable_and_nobody_asks_for_it) {
  projector::dlp::Dialogue dialogue(std::make_unique<EmulatedTransport>(device), 6);
  EXPECT_EQ(dialogue.read(projector::dlp::Command::table_data, 12).error().code, ErrorCode::device_refused);
  EXPECT_EQ(dialogue.read(projector::dlp::Command::run, 1).error().code, ErrorCode::device_refused);
  device->refuse.clear();
  ASSERT_OK(begin());
}

TEST_F(Dlpc900, shows_24_planes_of_a_video_picture_and_is_left_as_it_was_found) {
  const std::string before = device->state();
  {
    const auto begun = begin();
    ASSERT_OK(begun);
    EXPECT_TRUE(device->shows_sequence());
    EXPECT_TRUE((*begun)->warnings().empty());
    EXPECT_EQ((*begun)->sequence().period_us, 683U);
    const auto shown = device->sequence();
    std::vector<int> wanted(24);
    std::iota(wanted.begin(), wanted.end(), 0);
    EXPECT_EQ(shown.patterns, wanted);
    EXPECT_EQ(shown.period_us, 683U);
    EXPECT_EQ(shown.exposure_us, 683U);
    EXPECT_EQ(shown.frame_lead_us, 20);
    ASSERT_OK((*begun)->check());
  }
  EXPECT_EQ(device->state(), before);
  EXPECT_FALSE(device->running());
}

// Its table is lost: nobody can read it. So the user is told.
TEST_F(Dlpc900, a_controller_that_showed_patterns_gets_its_mode_back_and_the_user_a_warning) {
  device->start_stored_patterns();
  const std::string before = device->state();
  {
    const auto begun = begin();
    ASSERT_OK(begun);
    EXPECT_TRUE(device->shows_sequence());
    ASSERT_EQ((*begun)->warnings().size(), 1U);
    EXPECT_NE((*begun)->warnings()[0].find("'stored patterns'"), std::string::npos);
    EXPECT_NE((*begun)->warnings()[0].find("send the table again"), std::string::npos);
  }
  EXPECT_EQ(device->state(), before);
  EXPECT_FALSE(device->running());
}

TEST_F(Dlpc900, keys_become_settings) {
  options.planes = 12;
  options.period_us = 1200;
  options.leds = 2;
  options.led_currents = LedCurrents{10, 20, 30};
  options.port = Port::display_port;
  options.plane_inverted = true;
  options.plane_delay = Nanoseconds{5'000};
  options.frame_delay = Nanoseconds{-10'000};
  const auto begun = begin();
  ASSERT_OK(begun);
  EXPECT_EQ(device->sequence().patterns.size(), 12U);
  EXPECT_EQ(device->sequence().period_us, 1200U);
  EXPECT_EQ(device->sequence().frame_lead_us, 15);
  EXPECT_EQ(device->setting(0x1A07), Bytes{2 | 8});
  EXPECT_EQ(device->setting(0x0B01), (Bytes{10, 20, 30}));
  EXPECT_EQ(device->setting(0x1A01), Bytes{2});
  EXPECT_EQ(device->setting(0x1A1D), (Bytes{0, 0xF6, 0xFF, 0, 0})) << "a pulse over all planes of a refresh";
  EXPECT_EQ(device->setting(0x1A1E), (Bytes{1, 5, 0, 25, 0})) << "a pulse at each plane";
}

TEST_F(Dlpc900, the_receiver_may_stay_as_it_is) {
  device->set(0x1A01, {2});
  options.port = std::nullopt;
  ASSERT_OK(begin());
  EXPECT_EQ(device->setting(0x1A01), Bytes{2});
}

TEST_F(Dlpc900, tells_its_state_without_a_change) {
  const std::string before = device->state();
  Controller c = controller();
  DlpController found;
  device->set(0x1A01, {1});
  ASSERT_OK(look(c, found));
  EXPECT_EQ(found.firmware, "6.0.1");
  EXPECT_EQ(found.mirrors, "DLP6500");
  EXPECT_EQ(found.leds, "sequence");
  EXPECT_TRUE(found.healthy);
  EXPECT_FALSE(found.patterns);
  EXPECT_TRUE(found.signal.locked);
  EXPECT_EQ(found.signal.grid, (Grid{1080, 1920}));
  EXPECT_NEAR(found.signal.refresh_hz, 60, 1e-3);
  device->set(0x1A01, {0});
  EXPECT_EQ(device->state(), before);
  device->start_stored_patterns();
  ASSERT_OK(look(c, found));
  EXPECT_TRUE(found.patterns);
  EXPECT_TRUE(found.running);
  EXPECT_FALSE(found.signal.locked);
  device->stalled = 1;
  EXPECT_EQ(look(c, found).error().code, ErrorCode::timeout);
}

TEST_F(Dlpc900, a_source_of_another_rate_or_size_is_refused) {
  device->hertz = 120;
  EXPECT_NE(refusal().what.find("120 pictures a second, but the screen's mode has 60"), std::string::npos);
  device->hertz = 60;
  source.grid = {1200, 1920};
  EXPECT_EQ(refusal().code, ErrorCode::device_refused);
  source = kScreen;
  device->columns = 1280;
  EXPECT_EQ(refusal().code, ErrorCode::device_refused);
  device->columns = 1920;
  device->mirrors = 2;  // those of a DLP9000
  EXPECT_NE(refusal().what.find("bit planes only of 2560x1600"), std::string::npos);
  device->mirrors = 77;
  EXPECT_NE(refusal().what.find("unknown kind, 77"), std::string::npos);
}

TEST_F(Dlpc900, standby_a_missing_signal_and_a_broken_sequencer_are_refused) {
  device->standby = true;
  EXPECT_NE(refusal().what.find("standby"), std::string::npos);
  device->standby = false;
  device->signal = false;
  EXPECT_NE(refusal().what.find("no stable video signal"), std::string::npos);
  device->signal = true;
  device->sequencer_fault = true;
  EXPECT_NE(refusal().what.find("sequencer"), std::string::npos);
}

TEST_F(Dlpc900, a_wrong_sequence_is_refused_before_the_controller_is_touched) {
  options.period_us = 100;
  EXPECT_EQ(refusal().code, ErrorCode::limit);
  EXPECT_TRUE(device->commands().empty());
}

TEST_F(Dlpc900, a_controller_that_loses_its_signal_in_pattern_mode_is_refused) {
  device->loses_lock = true;
  const std::string before = device->state();
  const auto begun = begin();
  ASSERT_FALSE(begun.ok());
  EXPECT_NE(begun.error().what.find("does not run the sequence"), std::string::npos) << begun.error().line();
  EXPECT_EQ(device->state(), before);
}

// A faster source than its timing says: the sequencer breaks off, and tells it.
TEST_F(Dlpc900, planes_that_do_not_end_before_vsync_are_found) {
  const auto begun = begin();
  ASSERT_OK(begun);
  Controller c = controller();
  ASSERT_OK(c.set_run(Run::stop));
  device->hertz = 70;
  ASSERT_OK(c.set_run(Run::start));
  EXPECT_EQ((*begun)->check().error().code, ErrorCode::device_lost);
}

TEST_F(Dlpc900, a_reset_and_another_programs_change_are_found_in_a_sequence) {
  const auto begun = begin();
  ASSERT_OK(begun);
  ASSERT_OK((*begun)->check());
  Controller c = controller();
  ASSERT_OK(c.set_led_enable({1, true}));
  EXPECT_EQ((*begun)->check().error().code, ErrorCode::device_lost);
  ASSERT_OK(c.set_led_enable({7, true}));
  ASSERT_OK((*begun)->check());
  device->reset();
  EXPECT_EQ((*begun)->check().error().code, ErrorCode::device_lost);
}

// The entry is wrong, and the controller tells nobody: begin() cannot find it. The rig's check with light
// does (tests/unit/rig/plane_schedule_test.cpp).
TEST_F(Dlpc900, a_wrong_entry_of_the_table_is_not_found_by_commands) {
  device->bad_entry = 17;
  const auto begun = begin();
  ASSERT_OK(begun);
  ASSERT_OK((*begun)->check());
  EXPECT_NE(device->sequence().patterns[17], 17);
}

/// Each command of begin() in turn is refused, not answered, or the device is reset or unplugged at it. No
/// such fault lets a wrong sequence run, and a controller that still answers is left as it was found.
TEST_F(Dlpc900, no_fault_at_any_command_leaves_another_state_or_a_wrong_sequence) {
  ASSERT_OK(begin());
  const auto all = static_cast<int>(device->commands().size());
  ASSERT_GT(all, 60);
  int refused = 0;
  for (const CommandFault kind : kCommandFaults)
    for (int at = 0; at < all; ++at) {
      device = std::make_shared<EmulatedDlpc900>();
      device->set(0x1A1E, {1, 9, 0, 10, 0});
      const std::string before = device->state();
      {
        auto begun = VideoPlanes::begin(Controller(std::make_unique<FaultyTransport>(device, kind, at)),
                                        source, options);
        refused += !begun.ok();
        if (begun && (*begun)->check().ok()) {
          EXPECT_TRUE(device->shows_sequence()) << static_cast<int>(kind) << " at " << at;
          EXPECT_EQ(device->sequence().patterns.size(), 24U);
        }
      }
      if (kind == CommandFault::refused || kind == CommandFault::not_answered) {
        EXPECT_EQ(device->state(), before) << static_cast<int>(kind) << " at " << at;
      }
      if (kind != CommandFault::unplugged) {
        EXPECT_FALSE(device->running());
      }
    }
  EXPECT_GT(refused, 2 * all) << "the faults did something";
}

}  // namespace
}  // namespace symrig::test::dlpc900_test

// A screen whose pictures an emulated DLPC900 splits into bit planes.

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
