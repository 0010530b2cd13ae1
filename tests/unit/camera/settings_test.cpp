// SPDX-License-Identifier: Apache-2.0
// Finding a camera, its format and its controls: what is accepted, and what each refusal says.
#include "assert_ok.hpp"
#include "fake_video.hpp"
#include "symrig/camera/internal/driver.hpp"
#include "symrig/camera/v4l2_camera.hpp"

#include <algorithm>
#include <cerrno>
#include <set>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

namespace symrig::settings_test {
namespace {

using test::FakeCamera;
using test::FakeSystem;

constexpr std::uint32_t kExposure = V4L2_CID_EXPOSURE_ABSOLUTE, kGain = V4L2_CID_GAIN,
                        kTrigger = V4L2_CID_USER_BASE + 0x1f00;

/// One fake camera at /dev/video0 and settings that fit it.
class Settings : public testing::Test {
 protected:
  Settings() {
    camera->formats = {{V4L2_PIX_FMT_YUYV, 16, {{6, 8}}},
                       {V4L2_PIX_FMT_GREY, 8, {{6, 8}}},
                       {V4L2_PIX_FMT_Y12, 16, {{6, 8}, {12, 16}}}};
    camera->controls = {
        {kGain, "Gain", V4L2_CTRL_TYPE_INTEGER, 0, 255, 5, 0},
        {kTrigger, "Trigger Mode", V4L2_CTRL_TYPE_MENU, 0, 2, 1, 0, 0, {"Free Run", "", "External Level"}},
        {kExposure, "Exposure Time, Absolute", V4L2_CTRL_TYPE_INTEGER, 1, 10'000, 1, 100}};
    system.cameras["/dev/video0"] = camera;
    settings.device = "/dev/video0";
  }

  Result<std::unique_ptr<V4l2Camera>> open() { return V4l2Camera::open(settings, system); }
  void expect_error(ErrorCode code, std::initializer_list<std::string_view> parts) {
    auto opened = open();
    ASSERT_FALSE(opened.ok());
    EXPECT_EQ(opened.error().code, code) << opened.error().line();
    for (const auto part : parts)
      EXPECT_NE(opened.error().line().find(part), std::string::npos) << opened.error().line();
    EXPECT_EQ(camera->mapped(), 0);
    EXPECT_FALSE(camera->streaming());
  }

  std::shared_ptr<FakeCamera> camera = std::make_shared<FakeCamera>();
  FakeSystem system;
  CameraSettings settings;
};

TEST_F(Settings, unasked_the_deepest_linear_format_is_taken) {
  auto opened = open();
  ASSERT_OK(opened);
  EXPECT_EQ((*opened)->format().name, "Y12");
  EXPECT_EQ((*opened)->grid(), (Grid{6, 8}));
  EXPECT_EQ((*opened)->noise().bits(), 12);
  EXPECT_NE((*opened)->describe().find("Y12 6x8 from /dev/video0 (Fake camera)"), std::string::npos)
      << (*opened)->describe();
}

TEST_F(Settings, a_picture_for_people_is_taken_if_asked_for_and_is_said_to_be_one) {
  settings.format = "YUYV";
  auto opened = open();
  ASSERT_OK(opened);
  const auto notes = (*opened)->report().notes;
  EXPECT_TRUE(std::any_of(notes.begin(), notes.end(),
                          [](const auto& note) { return note.find("not linear") != std::string::npos; }));
}

TEST_F(Settings, formats_that_are_not_there_are_refused_with_those_that_are) {
  settings.format = "Y16";
  expect_error(ErrorCode::device_refused, {"has no format Y16", "Y12 (6x8, 12x16)", "GREY (6x8)"});
  settings.format = "Y13";
  expect_error(ErrorCode::unknown_name, {"'Y13'", "did you mean 'Y1"});
  camera->formats = {{V4L2_PIX_FMT_MJPEG, 8, {{6, 8}}}, {V4L2_PIX_FMT_YUYV, 16, {{6, 8}}}};
  settings.format = "";
  expect_error(ErrorCode::device_refused, {"no linear format", "YUYV"});
}

TEST_F(Settings, a_driver_that_makes_something_else_of_it_is_refused) {
  settings.size = {480, 640};
  expect_error(ErrorCode::device_refused,
               {"asked for Y12 480x640, but the driver set Y12 6x8", "it offers", "12x16"});
  settings.size = {12, 16};
  camera->twist_format = [](v4l2_format& format) { format.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY; };
  expect_error(ErrorCode::device_refused, {"the driver set GREY 12x16"});
  camera->twist_format = [](v4l2_format& format) { format.fmt.pix.field = V4L2_FIELD_INTERLACED; };
  expect_error(ErrorCode::device_refused, {"interlaced pictures"});
}

// v4l2loopback 0.12.7 counts Y10 and Y12 as 10 and 12 bits a pixel, not 16.
TEST_F(Settings, a_layout_that_the_format_cannot_have_is_refused) {
  camera->twist_format = [](v4l2_format& format) { format.fmt.pix.bytesperline = 12; };
  expect_error(ErrorCode::device_refused, {"12 bytes per row, but Y12 6x8 needs 16"});
  camera->twist_format = [](v4l2_format& format) { format.fmt.pix.sizeimage = 72; };
  expect_error(ErrorCode::device_refused, {"72 bytes per picture", "needs 96"});
  camera->twist_format = [](v4l2_format& format) { format.fmt.pix.bytesperline = 0; };  // some do not say
  EXPECT_TRUE(open().ok());
  camera->twist_format = {};
  camera->twist_query = [](v4l2_buffer& buffer) { buffer.length = 90; };
  expect_error(ErrorCode::device_refused, {"buffers of 90 bytes", "needs 96"});
}

TEST_F(Settings, the_rate_is_verified) {
  settings.rate = 60;
  EXPECT_TRUE(open().ok());
  camera->twist_rate = [](v4l2_streamparm& p) { p.parm.capture.timeperframe = {1, 30}; };
  expect_error(ErrorCode::device_refused, {"60 pictures a second requested, but the driver gives 30"});
  settings.rate = -1;
  expect_error(ErrorCode::bad_argument, {"out of range"});
}

TEST_F(Settings, numbers_that_contradict_each_other_are_told) {
  settings.bits = 10;
  expect_error(ErrorCode::bad_argument, {"10 bits for Y12, which has 12"});
  settings.bits = 0;
  settings.noise = NoiseModel::from_electrons({.bits = 10});
  expect_error(ErrorCode::bad_argument, {"noise model has 10 bits, but Y12 has 12"});
  settings.noise.reset();
  settings.region = {0, 0, {7, 8}, 1};
  expect_error(ErrorCode::bad_argument, {"is not inside the picture of 6x8"});
  settings.region = {0, 0, {}, 2};
  settings.dead = Image<std::uint8_t>({6, 8});
  expect_error(ErrorCode::size_mismatch, {"dead pixels is 6x8, frames are 3x4"});
  settings.dead = {};
  settings.buffers = 1;
  expect_error(ErrorCode::bad_argument, {"1 buffers", "2 to 32"});
  settings.buffers = 8;
  settings.waiting = 0;
  expect_error(ErrorCode::bad_argument, {"queue of 0"});
}

TEST_F(Settings, what_the_kernel_refuses_is_said_in_words) {
  system.refusals["/dev/video0"] = EACCES;
  expect_error(ErrorCode::device_refused, {"no permission to open", "group video"});
  system.refusals["/dev/video0"] = EBUSY;
  expect_error(ErrorCode::device_refused, {"another program uses", "fuser"});
  system.refusals["/dev/video0"] = ENOENT;
  expect_error(ErrorCode::device_lost, {"is missing"});
  system.refusals.clear();
  camera->fail(VIDIOC_S_FMT, EBUSY);
  expect_error(ErrorCode::device_refused, {"another program uses", "setting the format Y12 6x8"});
  camera->fail(VIDIOC_REQBUFS, EBUSY);
  expect_error(ErrorCode::device_refused, {"another program uses"});
  camera->fail(VIDIOC_REQBUFS, ENOMEM);
  expect_error(ErrorCode::device_refused, {"asking for 8 buffers"});
  camera->fail(VIDIOC_STREAMON, ENODEV);
  expect_error(ErrorCode::device_lost, {"is lost", "starting the stream"});
  camera->fail(VIDIOC_QUERYCAP, ENOTTY);
  expect_error(ErrorCode::device_refused, {"is not a V4L2 device"});
  camera->twist_request = [](v4l2_requestbuffers& request) { request.count = 1; };
  expect_error(ErrorCode::device_refused, {"1 buffer(s)"});
  camera->capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  expect_error(ErrorCode::device_refused, {"does not stream pictures"});
}

TEST_F(Settings, calls_that_a_signal_interrupts_are_made_again) {
  camera->fail(VIDIOC_QUERYCAP, EINTR, 3);
  camera->fail(VIDIOC_S_FMT, EINTR, 2);
  camera->fail(VIDIOC_STREAMON, EINTR);
  EXPECT_TRUE(open().ok());
  camera->fail(VIDIOC_S_FMT, EINTR, 1000);  // for ever is no signal
  expect_error(ErrorCode::device_refused, {"Interrupted"});
}

TEST_F(Settings, a_camera_is_found_by_what_it_is_called) {
  auto other = std::make_shared<FakeCamera>();
  other->bus = "usb-2", other->serial = "S2";
  system.cameras["/dev/video3"] = other;
  const auto chosen = [&](std::string_view wanted) {
    auto path = choose_camera(system, wanted);
    return path ? *path : path.error().line();
  };
  EXPECT_EQ(chosen("S2"), "/dev/video3");
  EXPECT_EQ(chosen("usb-2"), "/dev/video3");
  EXPECT_EQ(chosen("/dev/v4l/by-id/anything"), "/dev/v4l/by-id/anything");
  EXPECT_NE(chosen("Fake camera").find("several cameras are called 'Fake camera'"), std::string::npos);
  EXPECT_NE(chosen("").find("several cameras found"), std::string::npos);
  EXPECT_NE(
      chosen("S3").find("no camera is called 'S3'; did you mean 'S2'? there are /dev/video0 (Fake camera)"),
      std::string::npos);
  system.cameras.erase("/dev/video3");
  EXPECT_EQ(chosen(""), "/dev/video0");
  system.cameras.clear();
  EXPECT_NE(chosen("").find("no camera found"), std::string::npos);
}

TEST_F(Settings, looking_finds_cameras_only_and_those_that_may_not_be_opened_with_the_reason) {
  auto output = std::make_shared<FakeCamera>();
  output->capabilities = V4L2_CAP_VIDEO_OUTPUT;
  system.cameras["/dev/video1"] = output;
  system.refusals["/dev/video2"] = EACCES;
  const auto found = find_cameras(system);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].name, "Fake camera");
  EXPECT_EQ(found[0].driver, "fake");
  EXPECT_EQ(found[0].bus, "platform:fake");
  EXPECT_EQ(found[1].path, "/dev/video2");
  ASSERT_TRUE(found[1].error);
  EXPECT_NE(found[1].error->line().find("group video"), std::string::npos);
}

TEST_F(Settings, a_look_at_a_camera_tells_formats_and_controls_and_changes_nothing) {
  const auto info = look_at_camera(system, "/dev/video0");
  ASSERT_OK(info);
  ASSERT_EQ(info->formats.size(), 3U);
  EXPECT_EQ(info->formats[2].name(), "Y12");
  ASSERT_EQ(info->formats[2].sizes.size(), 2U);
  EXPECT_TRUE(info->formats[2].sizes[1].holds({12, 16}));
  EXPECT_EQ(info->formats[2].sizes[1].slowest, 30);
  EXPECT_EQ(info->formats[2].sizes[1].fastest, 60);
  ASSERT_EQ(info->controls.size(), 3U);
  EXPECT_EQ(info->controls[2].name, "exposure_time_absolute");
  EXPECT_EQ(info->controls[2].value, 100);
  ASSERT_EQ(info->controls[1].menu.size(), 2U);
  EXPECT_EQ(info->controls[1].range(), "0 (Free Run), 2 (External Level)");
  EXPECT_EQ(camera->calls(VIDIOC_S_FMT) + camera->calls(VIDIOC_S_EXT_CTRLS) + camera->calls(VIDIOC_REQBUFS),
            0U);
}

TEST_F(Settings, controls_are_set_in_order_and_read_back) {
  settings.controls = {{"trigger_mode", "External Level"}, {"exposure_time_absolute", "83"}, {"gain", "10"}};
  auto opened = open();
  ASSERT_OK(opened);
  EXPECT_EQ((*opened)->control("trigger_mode").value(), 2);
  EXPECT_EQ((*opened)->control("exposure_time_absolute").value(), 83);
  ASSERT_OK((*opened)->set_control("gain", "15"));
  EXPECT_EQ((*opened)->control("gain").value(), 15);
}

TEST_F(Settings, values_that_cannot_be_name_the_nearest) {
  const auto refusal = [&](const char* name, const char* value) {
    settings.controls = {{name, value}};
    auto opened = open();
    return opened ? std::string("taken") : opened.error().line();
  };
  EXPECT_NE(refusal("gain", "13")
                .find("control gain takes 0 to 255 in steps of 5, not 13; the nearest value is 15"),
            std::string::npos)
      << refusal("gain", "13");
  EXPECT_NE(refusal("gain", "12").find("nearest value is 10"), std::string::npos);
  EXPECT_NE(refusal("gain", "-7").find("nearest value is 0"), std::string::npos);
  EXPECT_NE(refusal("gain", "999").find("nearest value is 255"), std::string::npos);
  EXPECT_NE(refusal("gain", "loud").find("does not take 'loud'; it takes 0 to 255"), std::string::npos);
  EXPECT_NE(refusal("trigger_mode", "1").find("it takes 0 (Free Run), 2 (External Level)"),
            std::string::npos);
  EXPECT_NE(refusal("gian", "1").find("no control 'gian'; did you mean 'gain'?"), std::string::npos);
}

TEST_F(Settings, a_driver_that_keeps_another_value_is_found_out) {
  camera->controls[0].hold = [](std::int64_t value) { return value / 16 * 16; };
  settings.controls = {{"gain", "40"}};
  expect_error(ErrorCode::device_refused, {"control gain became 32, not 40"});
  settings.controls = {{"gain", "80"}};
  EXPECT_TRUE(open().ok());
}

TEST_F(Settings, a_control_that_another_rules_says_so) {
  camera->controls[2].flags = V4L2_CTRL_FLAG_INACTIVE;
  camera->fail(VIDIOC_S_EXT_CTRLS, EIO);
  settings.controls = {{"exposure_time_absolute", "50"}};
  expect_error(ErrorCode::device_refused,
               {"setting control exposure_time_absolute to 50", "switch off the automatic control first"});
  camera->controls[2].flags = V4L2_CTRL_FLAG_READ_ONLY;
  expect_error(ErrorCode::device_refused, {"is read-only"});
}

TEST_F(Settings, controls_beyond_32_bits_and_odd_ones) {
  camera->controls = {{kGain, "Pixel Rate", V4L2_CTRL_TYPE_INTEGER64, 0, 1LL << 40, 1, 1LL << 35},
                      {kGain + 1, "Do It", V4L2_CTRL_TYPE_BUTTON, 0, 0, 0, 0},
                      {kGain + 2, "Flip", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1, 0},
                      {kGain + 3, "Text", V4L2_CTRL_TYPE_STRING, 0, 10, 1, 0}};
  auto opened = open();
  ASSERT_OK(opened);
  EXPECT_EQ((*opened)->control("pixel_rate").value(), 1LL << 35);
  ASSERT_OK((*opened)->set_control("pixel_rate", "68719476737"));
  EXPECT_EQ((*opened)->control("pixel_rate").value(), 68719476737);
  ASSERT_OK((*opened)->set_control("do_it", "1"));
  ASSERT_OK((*opened)->set_control("flip", "on"));
  EXPECT_EQ((*opened)->control("flip").value(), 1);
  EXPECT_FALSE((*opened)->set_control("text", "3").ok());
}

TEST_F(Settings, drivers_that_never_come_to_an_end_do_not_hang) {
  camera->formats.assign(300, {V4L2_PIX_FMT_Y12, 16, {{6, 8}}});
  camera->formats.resize(1000, {V4L2_PIX_FMT_GREY, 8, {{6, 8}}});
  const auto info = look_at_camera(system, "/dev/video0");
  ASSERT_OK(info);
  EXPECT_EQ(info->formats.size(), 256U);
}

TEST(CameraDrivers, describe_themselves) {
  std::set<std::string_view> names, prefixes;
  for (const camera::CameraDriver& driver : camera::camera_drivers()) {
    EXPECT_TRUE(names.insert(driver.name).second) << driver.name;
    EXPECT_TRUE(prefixes.insert(driver.prefix).second)
        << driver.name << ": its paths are those of another driver";
    EXPECT_FALSE(driver.about.empty()) << driver.name;
    EXPECT_TRUE(driver.form.starts_with(driver.prefix)) << driver.form;
    EXPECT_NE(camera_path_forms().find(driver.form), std::string::npos) << driver.form;
    EXPECT_TRUE(driver.read != nullptr && driver.find != nullptr && driver.look != nullptr) << driver.name;
  }
}

}  // namespace
}  // namespace symrig::settings_test
