// SPDX-License-Identifier: Apache-2.0
// The keys of `[camera]` with driver = "genicam", down to a camera that they set up.

#include "assert_ok.hpp"
#include "gige/gige_camera.hpp"
#include "symrig/camera/internal/counts.hpp"
#include "symrig/camera/internal/genicam_camera.hpp"
#include "symrig/camera/internal/network.hpp"

#include <span>
#include <string>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>

namespace symrig::genicam_keys_test {
namespace {

using namespace std::chrono_literals;

/// The source that the keys name, or the first error.
Result<std::unique_ptr<camera::CameraSource>> source_of(const std::string& keys) {
  SYMRIG_TRY(const base::TomlNode document, base::parse_toml(keys, "rig.toml"));
  base::ReadContext context{"rig.toml"};
  base::TableReader table(document, "camera", context);
  auto source = camera::read_genicam_camera(table);
  table.finish();
  if (!context.state) return context.state.error();
  return source;
}

TEST(GenicamKeys, set_up_a_camera) {
  gige::GigeCamera device({}, [](const gige::Shot&, std::span<std::uint16_t>) {});
  const auto source = source_of(fmt::format(
      "device = \"{}\"\nformat = \"Mono12\"\nregion = {{ row = 8, col = 0, rows = 16, cols = 32 }}\nbinning "
      "= 2\ncamera_binning = 1\n"
      "exposure = \"5 ms\"\ngain = 2\nblack_level = 4\n[features]\nTriggerDelay = 1.5\nLineInverter = true\n",
      device.address()));
  ASSERT_OK(source);
  camera::SensorFacts facts;
  facts.bits = 12;
  const auto camera = (*source)->open(facts);
  ASSERT_OK(camera);
  EXPECT_EQ((*camera)->grid(), (Grid{8, 16}));
  EXPECT_EQ(device.reg(0x1002C), 0U) << "ExposureMode is Timed";
  EXPECT_EQ(device.reg(0x10030), 5'000'000U) << "ExposureTime in nanoseconds";
  EXPECT_EQ(device.reg(0x10034), 1500U) << "TriggerDelay in nanoseconds";
  EXPECT_EQ(device.reg(0x10038), 2U);
  EXPECT_EQ(device.reg(0x1003C), 4U);
  EXPECT_EQ(device.reg(0x10064), 1U);
  EXPECT_NE((*source)->identity(facts).find("camera binning 1"), std::string::npos);
  EXPECT_NE((*source)->identity(facts).find("TriggerDelay 1.5"), std::string::npos);
}

void expect_error(const std::string& keys, std::string_view part) {
  const auto source = source_of(keys);
  ASSERT_FALSE(source.ok()) << keys;
  EXPECT_NE(source.error().line().find(part), std::string::npos) << source.error().line();
}

TEST(GenicamKeys, name_what_is_wrong) {
  expect_error("lines = \"Line1\"\n", "line");
  expect_error("stamp = \"begin\"\n", "exposure-begin");
  expect_error("exposure = \"wide\"\n", "camera.exposure");
  expect_error("features = 3\n", "camera.features");
  expect_error("[features]\nGamma = [1]\n", "camera.features.Gamma");
}

TEST(GenicamKeys, an_address_where_no_camera_is_gives_a_lost_device) {
  const auto source = source_of("device = \"127.9.9.9\"\n");
  ASSERT_OK(source);
  const auto camera = (*source)->open({});
  ASSERT_FALSE(camera.ok());
  EXPECT_EQ(camera.error().code, ErrorCode::device_lost) << camera.error().line();
  EXPECT_NE(camera.error().line().find("127.9.9.9"), std::string::npos) << camera.error().line();
}

}  // namespace
}  // namespace symrig::genicam_keys_test

namespace symrig::frame_numbers_test {
namespace {

using camera::CountStep;
using camera::FrameNumbers;

TEST(FrameNumbers, ids_of_16_bits_skip_0) {
  FrameNumbers numbers;
  EXPECT_EQ(numbers.read(65'534, {}).number, 65'534U);
  EXPECT_EQ(numbers.read(65'535, {}).number, 65'535U);
  const auto after = numbers.read(1, {});
  EXPECT_EQ(after.number, 65'536U);
  EXPECT_EQ(after.step, CountStep::next);
  const auto gap = numbers.read(4, {});
  EXPECT_EQ(gap.missing, 2U);
  EXPECT_EQ(numbers.read(3, {}).step, CountStep::backwards);
  EXPECT_EQ(numbers.read(5, {}).missing, 0U);
}

TEST(FrameNumbers, ids_of_64_bits_are_taken_as_they_are) {
  FrameNumbers numbers;
  EXPECT_EQ(numbers.read(0, {}).number, 0U);
  EXPECT_EQ(numbers.read(1, {}).number, 1U);
  EXPECT_EQ(numbers.read(70'000, {}).missing, 69'998U);
}

TEST(FrameNumbers, the_trigger_counter_shows_triggers_without_a_frame) {
  FrameNumbers numbers;
  numbers.read(1, 10);
  const auto reading = numbers.read(2, 13);
  EXPECT_EQ(reading.number, 13U);
  EXPECT_EQ(reading.missing, 2U);
  // A damaged frame has no counter: its id continues. The next counter is measured from the last one.
  EXPECT_EQ(numbers.read(3, {}).number, 14U);
  EXPECT_EQ(numbers.read(4, 16).number, 16U);
  // Two frames in the wrong order.
  EXPECT_EQ(numbers.read(5, 18).missing, 1U);
  EXPECT_EQ(numbers.read(6, 17).step, CountStep::backwards);
  EXPECT_EQ(numbers.read(7, 19).missing, 0U);
}

TEST(FrameNumbers, a_number_that_was_left_out_is_found_once) {
  FrameNumbers numbers;
  numbers.read(1, 1);
  EXPECT_EQ(numbers.read(2, 4).missing, 2U);
  EXPECT_TRUE(numbers.read(3, 2).found);
  EXPECT_TRUE(numbers.read(4, 3).found);
  EXPECT_FALSE(numbers.read(5, 3).found);
  EXPECT_FALSE(numbers.read(6, 5).found);
}

TEST(FrameNumbers, a_stream_that_begins_anew_leaves_a_gap) {
  FrameNumbers numbers;
  numbers.read(500, {});
  numbers.restart();
  EXPECT_GT(numbers.read(0, {}).number, 501U);
}

}  // namespace
}  // namespace symrig::frame_numbers_test

namespace symrig::packet_size_test {
namespace {

using namespace std::chrono_literals;

TEST(PacketSize, must_fit_the_network_of_this_computer) {
  EXPECT_TRUE(camera::check_packet_size("genicam:10.0.0.7", 1500, {"eth0", 1500}).ok());
  EXPECT_TRUE(camera::check_packet_size("genicam:10.0.0.7", 9000, {"eth0", 0}).ok());
  const auto refused = camera::check_packet_size("genicam:10.0.0.7", 9000, {"eth0", 1500});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::device_refused);
  for (const char* part : {"9000 bytes", "eth0", "GevSCPSPacketSize = 1500", "ip link set eth0 mtu 9000"})
    EXPECT_NE(refused.error().line().find(part), std::string::npos) << refused.error().line();
}

TEST(PacketSize, the_loopback_network_is_found_by_its_address) {
  in_addr address{};
  address.s_addr = htonl(INADDR_LOOPBACK);
  const auto network = camera::interface_at(address);
  ASSERT_TRUE(network);
  EXPECT_EQ(network->name, "lo");
  EXPECT_GE(network->mtu, 1500);
  address.s_addr = inet_addr("203.0.113.9");  // a network of documentation
  EXPECT_FALSE(camera::interface_at(address));
}

TEST(PacketSize, is_set_by_the_cameras_own_feature) {
  gige::GigeCamera device({}, gige::numbered_scene);
  camera::GenicamSettings settings;
  settings.device = device.address();
  settings.format = "Mono16";
  settings.features = {{"GevSCPSPacketSize", "9000"}};
  auto opened = camera::GenicamCamera::open(settings);
  ASSERT_OK(opened);
  EXPECT_EQ(device.reg(0xD04) & 0xFFFFU, 9000U);
  device.pulse(200us);
  const auto frames = (*opened)->take(1, 2s);
  ASSERT_OK(frames);
  ASSERT_EQ(frames->size(), 1U);
  EXPECT_TRUE(gige::shows(frames->front().raw, 1, 200us));
}

}  // namespace
}  // namespace symrig::packet_size_test
