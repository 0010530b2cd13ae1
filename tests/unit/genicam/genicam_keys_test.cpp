// SPDX-License-Identifier: Apache-2.0
// The keys of `[camera]` with driver = "genicam", down to a camera that they set up.
#include "assert_ok.hpp"
#include "camera/genicam/genicam_driver.hpp"
#include "gige/gige_camera.hpp"

#include <span>
#include <string>

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
