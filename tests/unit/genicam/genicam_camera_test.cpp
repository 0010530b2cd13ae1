// SPDX-License-Identifier: Apache-2.0
// A GenICam camera by Aravis: what is set, what is refused, and which frames arrive.
#include "symrig/camera/internal/genicam_camera.hpp"

#include "assert_ok.hpp"
#include "gige/gige_camera.hpp"

#include <algorithm>
#include <any>
#include <string>
#include <thread>
#include <utility>

#include <gtest/gtest.h>

namespace symrig::genicam_camera_test {
namespace {

using namespace std::chrono_literals;
using camera::FrameChunks;
using camera::GenicamCamera;
using camera::GenicamSettings;
using gige::CameraTraits;
using gige::GigeCamera;
using gige::Shot;

/// All pixels are those of the trigger that the first pixel names.
bool whole(const CameraFrame& frame, std::chrono::nanoseconds exposure) {
  return gige::shows(frame.raw, frame.raw[0], exposure);
}

GenicamSettings settings_for(const GigeCamera& device) {
  GenicamSettings settings;
  settings.device = device.address();
  settings.format = "Mono16";
  return settings;
}

constexpr Nanoseconds kPatience = 2s;

TEST(GenicamCamera, each_frame_is_exposed_as_long_as_its_pulse) {
  GigeCamera device({}, gige::numbered_scene);
  auto opened = GenicamCamera::open(settings_for(device));
  ASSERT_OK(opened);
  GenicamCamera& camera = **opened;
  EXPECT_EQ(camera.grid(), (Grid{64, 64}));
  EXPECT_EQ(camera.found().name, "Symrig Loopback");
  EXPECT_EQ(camera.found().serial, "S" + device.address().substr(4));
  EXPECT_EQ(device.reg(0x1002C), 1U) << "ExposureMode is TriggerWidth";
  for (int k = 0; k < 50; ++k) {
    const auto width = (100 + 13 * k) * 1us;
    ASSERT_TRUE(device.pulse(width));
    auto frames = camera.take(1, kPatience);
    ASSERT_OK(frames);
    ASSERT_EQ(frames->size(), 1U) << camera.report().to_string();
    EXPECT_FALSE(frames->front().damaged);
    EXPECT_TRUE(whole(frames->front(), width)) << k;
    const auto* const chunks = std::any_cast<FrameChunks>(&frames->front().attachment);
    ASSERT_NE(chunks, nullptr);
    EXPECT_EQ(chunks->trigger_counter, static_cast<std::uint32_t>(k + 1));
    EXPECT_EQ(chunks->exposure, Nanoseconds(width));
  }
}

TEST(GenicamCamera, every_format_delivers_its_upper_bits) {
  for (const auto& [name, bits] : std::initializer_list<std::pair<const char*, int>>{{"Mono8", 8},
                                                                                     {"Mono10", 10},
                                                                                     {"Mono12", 12},
                                                                                     {"Mono12p", 12},
                                                                                     {"Mono12Packed", 12},
                                                                                     {"BayerRG12", 12}}) {
    GigeCamera device({}, gige::numbered_scene);
    GenicamSettings settings = settings_for(device);
    settings.format = name;
    auto opened = GenicamCamera::open(settings);
    ASSERT_OK(opened);
    EXPECT_EQ((*opened)->noise().bits(), bits);
    EXPECT_EQ((*opened)->mosaic(), std::string_view(name) == "BayerRG12" ? Mosaic::rggb : Mosaic::none);
    device.pulse(300us);
    auto frames = (*opened)->take(1, kPatience);
    ASSERT_OK(frames);
    ASSERT_EQ(frames->size(), 1U) << name;
    Shot shot;
    shot.counter = 1;
    shot.exposure = 300us;
    for (std::size_t k = 0; k < frames->front().raw.size(); ++k)
      ASSERT_EQ(frames->front().raw[k], gige::numbered_code(shot, k) >> (16 - bits)) << name << " " << k;
  }
}

TEST(GenicamCamera, region_gain_features_and_timing_are_the_cameras) {
  GigeCamera device({}, gige::numbered_scene);
  GenicamSettings settings = settings_for(device);
  settings.region = {8, 16, {32, 24}, 2};
  settings.gain = 3;
  settings.black_level = 17;
  settings.features = {{"LineInverter", "true"}, {"TriggerDelay", "250"}};
  settings.timing.readout = 1ms;
  settings.timing.trigger_delay = 30us;
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  EXPECT_EQ((*opened)->grid(), (Grid{16, 12}));
  EXPECT_EQ(device.reg(0x10000), 24U);
  EXPECT_EQ(device.reg(0x10004), 32U);
  EXPECT_EQ(device.reg(0x10008), 16U);
  EXPECT_EQ(device.reg(0x1000C), 8U);
  EXPECT_EQ(device.reg(0x10038), 3U);
  EXPECT_EQ(device.reg(0x1003C), 17U);
  EXPECT_EQ(device.reg(0x10064), 1U);
  EXPECT_EQ((*opened)->timing().readout, 4ms) << "SensorReadoutTime";
  EXPECT_EQ((*opened)->timing().trigger_delay, 250us + 30us) << "TriggerDelay, and what the rig file says";
  EXPECT_EQ((*opened)->timing().overlap, 0us);
  EXPECT_EQ((*opened)->timing().max_exposure, 1s);
}

TEST(GenicamCamera, a_delay_and_an_overlap_that_another_program_left_are_removed) {
  GigeCamera device({}, gige::numbered_scene);
  EXPECT_NE(device.reg(0x10034), 0U);
  EXPECT_NE(device.reg(0x10088), 0U);
  auto opened = GenicamCamera::open(settings_for(device));
  ASSERT_OK(opened);
  EXPECT_EQ(device.reg(0x10034), 0U) << "TriggerDelay";
  EXPECT_EQ(device.reg(0x10088), 0U) << "TriggerOverlap";
  EXPECT_EQ((*opened)->timing().readout, 4ms);
}

TEST(GenicamCamera, overlaps_its_readout_if_it_is_told_to) {
  GigeCamera device({}, gige::numbered_scene);
  GenicamSettings settings = settings_for(device);
  settings.overlap = true;
  {
    auto opened = GenicamCamera::open(settings);
    ASSERT_OK(opened);
    EXPECT_EQ(device.reg(0x10088), 1U) << "TriggerOverlap is ReadOut";
    EXPECT_EQ((*opened)->timing().readout, 4ms);
    EXPECT_EQ((*opened)->timing().overlap, 4ms);
  }
  gige::CameraTraits limited;
  limited.longest_overlap = 1500us;
  GigeCamera other(limited, gige::numbered_scene);
  settings = settings_for(other);
  settings.overlap = true;
  {
    auto opened = GenicamCamera::open(settings);
    ASSERT_OK(opened);
    EXPECT_EQ((*opened)->timing().overlap, 1500us) << "ExposureOverlapTimeMax";
  }
  gige::CameraTraits plain;
  plain.can_overlap = false;
  GigeCamera third(plain, gige::numbered_scene);
  settings = settings_for(third);
  settings.overlap = true;
  const auto refused = GenicamCamera::open(settings);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().line().find("remove camera.overlap"), std::string::npos)
      << refused.error().line();
}

TEST(GenicamCamera, the_camera_bins_its_pixels_itself) {
  GigeCamera device({}, gige::numbered_scene);
  GenicamSettings settings = settings_for(device);
  settings.camera_binning = 2;
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  EXPECT_EQ((*opened)->grid(), (Grid{32, 32}));
  EXPECT_EQ(device.reg(0x10078), 2U) << "BinningHorizontal";
  EXPECT_EQ(device.reg(0x1007C), 2U) << "BinningVertical";
  device.pulse(200us);
  auto frames = (*opened)->take(1, kPatience);
  ASSERT_OK(frames);
  ASSERT_EQ(frames->size(), 1U);
  EXPECT_TRUE(whole(frames->front(), 200us));
}

void expect_refused(const GenicamSettings& settings, ErrorCode code,
                    std::initializer_list<std::string_view> parts) {
  const auto opened = GenicamCamera::open(settings);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, code) << opened.error().line();
  for (const auto part : parts)
    EXPECT_NE(opened.error().line().find(part), std::string::npos) << opened.error().line();
}

TEST(GenicamCamera, what_the_camera_does_not_have_is_refused_by_name) {
  GigeCamera device({}, gige::numbered_scene);
  const GenicamSettings good = settings_for(device);
  GenicamSettings bad = good;
  bad.format = "Mono61";
  expect_refused(bad, ErrorCode::unknown_name, {"Mono61", "Mono16"});
  bad = good;
  bad.format = "RGB8";
  expect_refused(bad, ErrorCode::unknown_name, {"cannot read", "RGB8"});
  bad = good;
  bad.line = "Line9";
  expect_refused(bad, ErrorCode::bad_argument, {"TriggerSource", "Line9", "Line1"});
  bad = good;
  bad.features = {{"LineInvertor", "true"}};
  expect_refused(bad, ErrorCode::unknown_name, {"LineInvertor", "LineInverter"});
  bad.features = {{"BlackLevel", "256"}};
  expect_refused(bad, ErrorCode::bad_argument, {"BlackLevel", "256", "0 to 255"});
  bad.features = {{"LineInverter", "perhaps"}};
  expect_refused(bad, ErrorCode::bad_argument, {"LineInverter", "true or false"});
  bad = good;
  bad.region.size = {32, 72};
  expect_refused(bad, ErrorCode::bad_argument, {"Width", "72", "64"});
  bad = good;
  bad.camera_binning = 5;
  expect_refused(bad, ErrorCode::bad_argument, {"BinningHorizontal", "5", "1 to 4"});
  bad = good;
  bad.exposure = 2s;
  expect_refused(bad, ErrorCode::bad_argument, {"ExposureTime", "2000000", "1000000"});
  ASSERT_OK(GenicamCamera::open(good));
  CameraTraits plain;
  plain.has_binning = false;
  GigeCamera other(plain, gige::numbered_scene);
  bad = settings_for(other);
  bad.camera_binning = 2;
  expect_refused(bad, ErrorCode::unknown_name, {"BinningHorizontal"});
}

TEST(GenicamCamera, one_program_controls_a_camera_at_a_time) {
  GigeCamera device({}, gige::numbered_scene);
  auto first = GenicamCamera::open(settings_for(device));
  ASSERT_OK(first);
  expect_refused(settings_for(device), ErrorCode::device_refused, {"another program controls it"});
}

TEST(GenicamCamera, ids_of_16_bits_go_on_beyond_65535) {
  CameraTraits traits;
  traits.first_id = 65'530;
  traits.has_chunks = false;
  GigeCamera device(traits, gige::numbered_scene);
  auto opened = GenicamCamera::open(settings_for(device));
  ASSERT_OK(opened);
  for (std::uint64_t k = 0; k < 20; ++k) {
    device.pulse(200us);
    auto frames = (*opened)->take(1, kPatience);
    ASSERT_OK(frames);
    ASSERT_EQ(frames->size(), 1U) << k << ": " << (*opened)->report().to_string();
    EXPECT_EQ(frames->front().sequence, 65'530U + k);
  }
  EXPECT_EQ((*opened)->report().missing, 0U);
}

TEST(GenicamCamera, without_resend_a_lost_packet_damages_its_frame_and_is_named) {
  CameraTraits traits;
  traits.resends = false;
  traits.packet_loss = 0.05;
  GigeCamera device(traits, gige::numbered_scene);
  auto opened = GenicamCamera::open(settings_for(device));
  ASSERT_OK(opened);
  std::size_t damaged = 0, good = 0;
  for (int k = 0; k < 60; ++k) {
    device.pulse(200us);
    auto frames = (*opened)->take(1, 300ms);
    ASSERT_OK(frames);
    for (const CameraFrame& frame : *frames) {
      (frame.damaged ? damaged : good) += 1;
      EXPECT_TRUE(frame.damaged || whole(frame, 200us));
    }
  }
  EXPECT_GT(damaged, 0U);
  EXPECT_GT(good, 0U);
  const StreamReport report = (*opened)->report();
  EXPECT_EQ(report.damaged, damaged);
  EXPECT_TRUE(std::ranges::any_of(report.notes, [](const std::string& note) {
    return note.starts_with("packets of a frame were lost") ||
           note.starts_with("a frame did not end in time");
  }));
}

TEST(GenicamCamera, a_full_queue_is_counted) {
  GigeCamera device({}, gige::numbered_scene);
  GenicamSettings settings = settings_for(device);
  settings.waiting = 3;
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  for (int k = 0; k < 10; ++k) device.pulse(200us);
  while ((*opened)->report().overflowed + (*opened)->report().delivered < 10)
    std::this_thread::sleep_for(1ms);
  EXPECT_EQ((*opened)->report().delivered, 3U);
  EXPECT_EQ((*opened)->report().overflowed, 7U);
  EXPECT_NE((*opened)->report().to_string().find("7 lost because the queue was full"), std::string::npos);
}

TEST(GenicamCamera, a_camera_that_reboots_is_lost_and_opens_again) {
  GigeCamera device({}, gige::numbered_scene);
  auto opened = GenicamCamera::open(settings_for(device));
  ASSERT_OK(opened);
  device.reboot();
  auto frames = (*opened)->take(1, 30s);
  ASSERT_FALSE(frames.ok());
  EXPECT_EQ(frames.error().code, ErrorCode::device_lost);
  EXPECT_NE(frames.error().line().find(device.address()), std::string::npos) << frames.error().line();
  opened->reset();
  auto again = GenicamCamera::open(settings_for(device));
  ASSERT_OK(again);
  EXPECT_TRUE(device.pulse(200us));
  auto good = (*again)->take(1, kPatience);
  ASSERT_OK(good);
  EXPECT_EQ(good->size(), 1U);
}

TEST(GenicamCamera, a_stamp_lies_between_its_pulse_and_its_arrival) {
  GigeCamera device({}, gige::numbered_scene);
  GenicamSettings settings = settings_for(device);
  settings.stamp = StampOf::exposure_end;
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  const Nanoseconds before = std::chrono::steady_clock::now().time_since_epoch();
  device.pulse(200us);
  auto frames = (*opened)->take(1, kPatience);
  ASSERT_OK(frames);
  ASSERT_EQ(frames->size(), 1U);
  const Nanoseconds after = std::chrono::steady_clock::now().time_since_epoch();
  // A latch is right to half of the 200 µs that it may take. A busy machine may have no such latch.
  if (frames->front().stamp_of == StampOf::nothing) {
    EXPECT_EQ((*opened)->report().unstamped, 1U);
    return;
  }
  EXPECT_EQ(frames->front().stamp_of, StampOf::exposure_end);
  EXPECT_GE(frames->front().stamp.since, before - 100us);
  EXPECT_LE(frames->front().stamp.since, after + 100us);
}

TEST(GenicamCamera, a_clock_that_is_latched_slowly_gives_no_stamps) {
  CameraTraits traits;
  traits.pending = 2ms;  // each register is written late, and PENDING_ACK says so
  GigeCamera device(traits, gige::numbered_scene);
  GenicamSettings settings = settings_for(device);
  settings.stamp = StampOf::exposure_end;
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  // A write that takes 2 ms cannot latch the clock to 100 µs: no stamp is better than a wrong one.
  device.pulse(200us);
  auto frames = (*opened)->take(1, kPatience);
  ASSERT_OK(frames);
  ASSERT_EQ(frames->size(), 1U);
  EXPECT_EQ(frames->front().stamp_of, StampOf::nothing);
  EXPECT_EQ((*opened)->report().unstamped, 1U);
}

#ifndef __SANITIZE_THREAD__  // the emulated camera is then too slow to fill a socket
/// Pulses until the frame of the newest trigger arrives, whole or not. Then all losses before it left a gap.
void close_with_a_frame(GigeCamera& device, GenicamCamera& camera, std::uint64_t& exposed) {
  for (int k = 0; k < 20; ++k) {
    device.pulse(200us);
    ++exposed;
    const auto frames = camera.take(1, kPatience);
    ASSERT_OK(frames);
    if (!frames->empty() && frames->back().sequence == exposed) return;
  }
  FAIL() << "no frame arrived in 20 pulses";
}

// The frames of a burst that find the socket full leave no trace in Aravis. If nothing follows them, no
// number tells of them either. The kernel counted their packets.
TEST(GenicamCamera, a_burst_that_finds_the_socket_full_is_counted) {
  CameraTraits traits;
  traits.resends = false;
  GigeCamera device(traits, gige::numbered_scene);
  GenicamSettings settings = settings_for(device);
  settings.waiting = 5000;
  settings.socket_limit = 32'768;  // three frames, as the kernel counts them
  auto opened = GenicamCamera::open(settings);
  ASSERT_OK(opened);
  GenicamCamera& camera = **opened;
  std::uint64_t exposed = 0;
  close_with_a_frame(device, camera, exposed);
  const auto words = [&camera] {
    for (const std::string& note : camera.report().notes)
      if (note.find("found this computer's socket full") != std::string::npos) return note;
    return std::string();
  };
  while (words().empty() && exposed < 20'000) {
    device.pulse(200us);
    ++exposed;
  }
  EXPECT_NE(words().find("sudo sysctl -w net.core.rmem_max=33554432"), std::string::npos) << words();
  close_with_a_frame(device, camera, exposed);
  const StreamReport report = camera.report();
  EXPECT_EQ(report.delivered + report.missing + report.overflowed, exposed) << report.to_string();
  EXPECT_GT(report.missing + report.damaged, 0U);
}
#endif

}  // namespace
}  // namespace symrig::genicam_camera_test
