// SPDX-License-Identifier: Apache-2.0
#include "camera/genicam/packet_size.hpp"

#include "assert_ok.hpp"
#include "camera/genicam/genicam_camera.hpp"
#include "gige/gige_camera.hpp"
#include "gige/numbered_scene.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>

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
