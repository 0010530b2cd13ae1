// SPDX-License-Identifier: Apache-2.0
// The protocol of a DLPC350 and its video-pattern mode, against an emulated controller.
#include "symrig/projector/internal/dlpc350.hpp"

#include "assert_ok.hpp"
#include "dlpc/emulated_controller.hpp"

#include <gtest/gtest.h>

namespace symrig::test::dlpc350_test {
namespace {

using namespace projector::dlpc350;
using projector::dlp::Bytes;
using projector::dlp::check_sequence;
using projector::dlp::Command;
using projector::dlp::command_body;
using projector::dlp::Dialogue;
using projector::dlp::kAllLeds;
using projector::dlp::LedCurrents;
using projector::dlp::LedEnable;
using projector::dlp::longest_period;
using projector::dlp::message_reports;
using projector::dlp::PictureSource;
using projector::dlp::Report;
using projector::dlp::Run;
using projector::dlp::Sequence;

constexpr PictureSource kScreen{{1140, 912}, Nanoseconds{16'666'667}};

class Dlpc350 : public ::testing::Test {
 protected:
  Dlpc350() { options.lock_patience = Nanoseconds{0}; }
  Controller controller() const { return Controller(std::make_unique<EmulatedTransport>(device)); }
  Result<std::unique_ptr<VideoPatterns>> begin() {
    return VideoPatterns::begin(controller(), source, options);
  }
  /// Begins, and expects a refusal before any sequence ran. The controller is then as it was found.
  Error refusal() {
    const std::string before = device->state();
    const auto begun = begin();
    EXPECT_FALSE(begun.ok());
    EXPECT_EQ(device->sequences_started(), 0) << "no light before a refusal";
    EXPECT_EQ(device->state(), before);
    EXPECT_FALSE(device->table_is_open());
    return begun ? Error{ErrorCode::fault, "none"} : begun.error();
  }

  std::shared_ptr<EmulatedDlpc350> device = std::make_shared<EmulatedDlpc350>();
  PictureSource source = kScreen;
  VideoPatternOptions options;
};

TEST(Dlpc350Messages, have_head_number_length_and_command_low_byte_first) {
  const auto one = message_reports(0x40, 7, command_body(Command::run, Bytes{2}));
  ASSERT_EQ(one.size(), 1U);
  const Report wanted{0x40, 7, 3, 0, 0x24, 0x1A, 2};
  EXPECT_EQ(one[0], wanted);
}

TEST(Dlpc350Messages, go_on_in_the_next_report_without_a_head) {
  Bytes data(72);
  for (std::size_t i = 0; i < data.size(); ++i) data[i] = static_cast<std::uint8_t>(i);
  const auto reports = message_reports(0x40, 1, command_body(Command::table_data, data));
  ASSERT_EQ(reports.size(), 2U);
  EXPECT_EQ(reports[0][2], 74);
  EXPECT_EQ(reports[0][63], 57);
  EXPECT_EQ(reports[1][0], 58);
  EXPECT_EQ(reports[1][13], 71);
  EXPECT_EQ(reports[1][14], 0);
}

TEST(Dlpc350Table, entries_are_the_bits_of_the_guide) {
  const TableEntry entry{
      .trigger = Trigger::rising, .plane = 5, .leds = 2, .black_after = true, .swaps_buffer = true};
  const auto bytes = to_bytes(entry);
  EXPECT_EQ(bytes[0], 5 << 2 | 1);
  EXPECT_EQ(bytes[1], 1 | 2 << 4);
  EXPECT_EQ(bytes[2], 2 | 4);
  EXPECT_EQ(entry_of(bytes), entry);
  for (const TableEntry& one : video_table(24, kAllLeds)) EXPECT_EQ(entry_of(to_bytes(one)), one);
}

TEST(Dlpc350Table, vsync_begins_a_video_sequence_and_black_ends_it) {
  const auto table = video_table(24, kAllLeds);
  ASSERT_EQ(table.size(), 24U);
  for (std::size_t k = 0; k < table.size(); ++k) {
    EXPECT_EQ(table[k].plane, static_cast<int>(k));
    EXPECT_EQ(table[k].trigger, k == 0 ? Trigger::rising : Trigger::continues);
    EXPECT_EQ(table[k].swaps_buffer, k == 0);
    EXPECT_EQ(table[k].black_after, k == 23);
    EXPECT_FALSE(table[k].joins) << "each plane has an edge of its own";
  }
}

TEST(Dlpc350Limits, delays_have_the_unit_and_range_of_the_guide) {
  EXPECT_EQ(*delay_code(Nanoseconds{0}), 0xBB);
  EXPECT_EQ(*delay_code(Nanoseconds{-20'050}), 0x00);
  EXPECT_EQ(*delay_code(Nanoseconds{2'787}), 0xD5);
  EXPECT_EQ(delay_code(Nanoseconds{-20'110}).error().code, ErrorCode::bad_argument);
  EXPECT_EQ(delay_code(Nanoseconds{2'850}).error().code, ErrorCode::bad_argument);
}

TEST(Dlpc350Limits, the_longest_period_leaves_room_for_black_and_a_fast_source) {
  for (const int hertz : {60, 120}) {
    const Nanoseconds refresh{1'000'000'000 / hertz};
    const auto period = longest_period(24, refresh, kPlaneLimits);
    ASSERT_OK(period);
    EXPECT_LE(24. * *period + 230, 0.999e-3 * static_cast<double>(refresh.count()));
    EXPECT_GT(24. * (*period + 1) + 230, 0.999e-3 * static_cast<double>(refresh.count()));
  }
  EXPECT_EQ(longest_period(24, Nanoseconds{5'000'000}, kPlaneLimits).error().code, ErrorCode::limit);
}

TEST(Dlpc350Limits, what_the_controller_refuses_is_refused_with_the_nearest_legal_value) {
  const Nanoseconds refresh{16'666'667};
  const auto error = [refresh](const Sequence& sequence) {
    const auto checked = check_sequence(sequence, refresh, kPlaneLimits);
    return checked ? std::string() : checked.error().hint;
  };
  EXPECT_EQ(error({24, 684, 684, kAllLeds}), "");
  EXPECT_EQ(error({24, 450, 684, kAllLeds}), "");
  EXPECT_EQ(error({24, 234, 684, kAllLeds}), "give at least 235 us");
  EXPECT_EQ(error({24, 455, 684, kAllLeds}), "give a period of 455 us, or of 685 us and more");
  EXPECT_EQ(error({24, 685, 685, kAllLeds}), "give a period of at most 684 us");
  EXPECT_EQ(error({25, 300, 300, kAllLeds}), "give 1 to 24");
  EXPECT_EQ(error({0, 300, 300, kAllLeds}), "give 1 to 24");
  EXPECT_EQ(error({24, 684, 684, 0}), "select red, green or blue");
}

TEST_F(Dlpc350, every_setting_is_read_as_it_was_written) {
  Controller c = controller();
  EXPECT_EQ(projector::dlp::to_string(*c.version()), "3.1.0");
  ASSERT_OK(c.set_times({400, 684}));
  EXPECT_EQ(*c.times(), (Times{400, 684}));
  ASSERT_OK(c.set_counts({24, true, 12, 3}));
  EXPECT_EQ(*c.counts(), (Counts{24, true, 12, 3}));
  EXPECT_EQ(device->setting(0x1A31), (Bytes{23, 1, 11, 2})) << "the guide counts from 0";
  const auto table = video_table(24, 3);
  ASSERT_OK(c.set_table(table));
  EXPECT_EQ(*c.table(24), table);
  EXPECT_FALSE(device->table_is_open());
  ASSERT_OK(c.set_trigger_out(1, {true, 3, 4}));
  EXPECT_EQ(*c.trigger_out(1), (TriggerOut{true, 3, 4}));
  ASSERT_OK(c.set_trigger_out(2, {true, 9}));
  EXPECT_EQ(*c.trigger_out(2), (TriggerOut{true, 9}));
  ASSERT_OK(c.set_led_enable({5, false}));
  EXPECT_EQ(*c.led_enable(), (LedEnable{5, false}));
  ASSERT_OK(c.set_led_currents({1, 2, 3}));
  EXPECT_EQ(*c.led_currents(), (LedCurrents{1, 2, 3}));
}

TEST_F(Dlpc350, tells_the_unit_of_the_signals_frequency_by_its_size) {
  for (const int hertz : {24, 50, 60, 120})
    for (const int unit : {1, 10, 100}) {
      device->hertz = hertz;
      device->hertz_unit = unit;
      Controller c = controller();
      const auto signal = c.signal();
      ASSERT_OK(signal);
      EXPECT_NEAR(signal->refresh_hz, hertz, 1e-9) << unit;
      EXPECT_EQ(signal->rows, 1140);
      EXPECT_EQ(signal->cols, 912);
    }
}

TEST_F(Dlpc350, drops_an_answer_that_comes_too_late) {
  Dialogue dialogue(std::make_unique<EmulatedTransport>(device), 3);
  device->late = 1;
  EXPECT_EQ(dialogue.read(Command::version, 16).error().code, ErrorCode::timeout);
  const auto byte = dialogue.read(Command::led_enable, 1);
  ASSERT_OK(byte);
  EXPECT_EQ(*byte, (Bytes{8})) << "not the version's bytes";
}

TEST_F(Dlpc350, a_command_that_is_refused_or_not_answered_is_an_error) {
  Controller c = controller();
  device->refuse[0x1A29] = 1;
  EXPECT_EQ(c.set_times({684, 684}).error().code, ErrorCode::device_refused);
  device->stalled = 1;
  EXPECT_EQ(c.times().error().code, ErrorCode::timeout);
  ASSERT_OK(c.times());
  device->unplugged_after = 0;
  EXPECT_EQ(c.times().error().code, ErrorCode::device_lost);
}

TEST_F(Dlpc350, a_check_may_take_its_time) {
  device->slow_check = 3;
  ASSERT_OK(begin());
}

TEST_F(Dlpc350, shows_24_planes_of_a_video_picture_and_is_left_as_it_was_found) {
  const std::string before = device->state();
  {
    const auto begun = begin();
    ASSERT_OK(begun);
    EXPECT_TRUE(device->shows_sequence());
    EXPECT_EQ((*begun)->sequence().planes, 24);
    EXPECT_EQ((*begun)->sequence().period_us, 684U);
    EXPECT_EQ(device->setting(0x1A22), Bytes{0}) << "patterns come from the video port";
    EXPECT_EQ(device->setting(0x1A23), Bytes{0}) << "VSYNC begins the sequence";
    EXPECT_EQ(device->setting(0x1A31), (Bytes{23, 1, 23, 0}));
    ASSERT_OK((*begun)->check());
  }
  EXPECT_EQ(device->state(), before);
}

TEST_F(Dlpc350, a_sequence_that_ran_before_runs_again_afterwards) {
  device->set(0x1A1B, {1});
  Controller c = controller();
  ASSERT_OK(c.set_times({9000, 9000}));
  ASSERT_OK(c.set_trigger_out(1, {true, 1, 2}));
  ASSERT_OK(c.validate());
  ASSERT_OK(c.set_run(Run::start));
  const std::string before = device->state();
  ASSERT_OK(begin());
  EXPECT_EQ(device->state(), before);
  EXPECT_EQ(device->running(), 2);
}

TEST_F(Dlpc350, keys_become_settings) {
  options.planes = 12;
  options.period_us = 1000;
  options.exposure_us = 700;
  options.leds = 2;
  options.led_currents = LedCurrents{10, 20, 30};
  options.port = Port::fpd_link;
  options.plane_inverted = true;
  options.frame_delay = Nanoseconds{0};
  const auto begun = begin();
  ASSERT_OK(begun);
  EXPECT_EQ(device->setting(0x1A29), (Bytes{0xBC, 2, 0, 0, 0xE8, 3, 0, 0}));
  EXPECT_EQ(device->setting(0x1A07), Bytes{2 | 8});
  EXPECT_EQ(device->setting(0x0B01), (Bytes{10, 20, 30}));
  EXPECT_EQ(device->setting(0x1A00)[0] & 7, 3);
  EXPECT_EQ(device->setting(0x1A1D), (Bytes{1, 0xBB, 0x00})) << "planes without dark time have edges, too";
  EXPECT_EQ(device->setting(0x1A1E), (Bytes{0, 0xBB}));
}

TEST_F(Dlpc350, tells_its_state_without_a_change) {
  const std::string before = device->state();
  Controller c = controller();
  DlpController found;
  ASSERT_OK(look(c, found));
  EXPECT_EQ(found.firmware, "3.1.0");
  EXPECT_EQ(found.leds, "sequence");
  EXPECT_EQ(found.currents, (std::array<int, 3>{0x97, 0x78, 0x7D}));
  EXPECT_TRUE(found.healthy);
  EXPECT_FALSE(found.patterns);
  EXPECT_TRUE(found.signal.locked);
  EXPECT_EQ(found.signal.grid, (Grid{1140, 912}));
  EXPECT_EQ(device->state(), before);
  device->set(0x1A07, {5});
  device->sequencer_fault = true;
  ASSERT_OK(look(c, found));
  EXPECT_EQ(found.leds, "red blue");
  EXPECT_FALSE(found.healthy);
  device->stalled = 1;
  EXPECT_EQ(look(c, found).error().code, ErrorCode::timeout);
}

TEST_F(Dlpc350, a_source_of_120_hz_is_refused) {
  device->hertz = 120;
  const Error error = refusal();
  EXPECT_EQ(error.code, ErrorCode::device_refused);
  EXPECT_NE(error.what.find("120 pictures a second, but the screen's mode has 60"), std::string::npos)
      << error.what;
}

TEST_F(Dlpc350, a_screen_of_another_size_is_refused) {
  source.grid = {1080, 1920};
  EXPECT_EQ(refusal().code, ErrorCode::device_refused);
  source = kScreen;
  device->columns = 1280;
  EXPECT_EQ(refusal().code, ErrorCode::device_refused);
}

TEST_F(Dlpc350, standby_a_missing_signal_and_a_broken_sequencer_are_refused) {
  device->standby = true;
  EXPECT_NE(refusal().what.find("standby"), std::string::npos);
  device->standby = false;
  device->signal = false;
  EXPECT_NE(refusal().what.find("no stable video signal"), std::string::npos);
  device->signal = true;
  device->sequencer_fault = true;
  EXPECT_NE(refusal().what.find("sequencer"), std::string::npos);
}

TEST_F(Dlpc350, a_wrong_sequence_is_refused_before_the_controller_is_touched) {
  options.period_us = 100;
  EXPECT_EQ(refusal().code, ErrorCode::limit);
  EXPECT_TRUE(device->commands().empty());
}

TEST_F(Dlpc350, a_table_that_reads_back_wrong_is_refused) {
  device->bad_entry = 17;
  const Error error = [this] {
    const auto begun = begin();
    return begun ? Error{ErrorCode::fault, "none"} : begun.error();
  }();
  EXPECT_EQ(error.code, ErrorCode::device_refused);
  EXPECT_NE(error.what.find("plane 17"), std::string::npos) << error.what;
  EXPECT_EQ(device->sequences_started(), 0);
  EXPECT_EQ(device->running(), 0);
}

TEST_F(Dlpc350, a_reset_in_a_sequence_is_found) {
  const auto begun = begin();
  ASSERT_OK(begun);
  device->reset();
  EXPECT_EQ((*begun)->check().error().code, ErrorCode::device_lost);
}

/// Each command of begin() in turn is refused, not answered, or the device is reset or unplugged at it. No
/// such fault lets a wrong sequence run, and a controller that still answers is left as it was found.
TEST_F(Dlpc350, no_fault_at_any_command_leaves_another_state_or_a_wrong_sequence) {
  ASSERT_OK(begin());
  const auto all = static_cast<int>(device->commands().size());
  ASSERT_GT(all, 40);
  int refused = 0;
  for (const CommandFault kind : kCommandFaults) {
    for (int at = 0; at < all; ++at) {
      device = std::make_shared<EmulatedDlpc350>();
      device->set(0x1A1D, {1, 9, 8});
      const std::string before = device->state();
      {
        auto begun = VideoPatterns::begin(Controller(std::make_unique<FaultyTransport>(device, kind, at)),
                                          source, options);
        refused += !begun.ok();
        if (begun) {
          const bool whole = (*begun)->check().ok();
          const bool right = device->shows_sequence() && device->table()[23][0] >> 2 == 23;
          EXPECT_TRUE(!whole || right) << static_cast<int>(kind) << " at " << at;
        }
      }
      if (kind == CommandFault::refused || kind == CommandFault::not_answered) {
        EXPECT_EQ(device->state(), before) << static_cast<int>(kind) << " at " << at;
        EXPECT_FALSE(device->table_is_open());
      }
      if (kind == CommandFault::reset) {
        EXPECT_EQ(device->running(), 0);
      }
    }
  }
  EXPECT_GT(refused, 2 * all) << "the faults did something";
}

}  // namespace
}  // namespace symrig::test::dlpc350_test
