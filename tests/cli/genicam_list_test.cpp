// SPDX-License-Identifier: Apache-2.0
// `symrig list` and `symrig info` of a GigE Vision camera on the loopback network.
#include "command.hpp"
#include "gige/gige_camera.hpp"

#include <algorithm>
#include <span>
#include <string>

namespace symrig::test::genicam_list_test {
namespace {

using Json = nlohmann::json;

class GenicamList : public CommandTest {
 protected:
  static gige::CameraTraits discoverable() {
    gige::CameraTraits traits;
    traits.discoverable = true;
    return traits;
  }
  std::string path_of_camera() const { return "genicam:" + device_.address(); }
  std::string serial() const { return "S" + device_.address().substr(4); }

  gige::GigeCamera device_{discoverable(), [](const gige::Shot&, std::span<std::uint16_t>) {}};
};

// Other tests may have cameras on this network at the same time.
TEST_F(GenicamList, shows_maker_model_serial_and_bus) {
  const Outcome outcome = symrig({"list", "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json cameras = Json::parse(outcome.out).at("cameras");
  const auto found =
      std::ranges::find_if(cameras, [this](const Json& one) { return one.at("node") == path_of_camera(); });
  ASSERT_NE(found, cameras.end()) << outcome.out;
  EXPECT_EQ(found->at("name"), "Symrig Loopback");
  EXPECT_EQ(found->at("serial"), serial());
  EXPECT_EQ(found->at("bus"), device_.address());
  EXPECT_EQ(found->at("driver"), "GigEVision");
  const Outcome text = symrig({"list"});
  EXPECT_NE(text.out.find(path_of_camera() + "  Symrig Loopback (GigEVision, " + device_.address() +
                          ", serial " + serial() + ")"),
            std::string::npos)
      << text.out;
}

TEST_F(GenicamList, info_shows_formats_and_features) {
  const Outcome outcome = symrig({"info", "--camera", path_of_camera(), "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json info = Json::parse(outcome.out);
  EXPECT_EQ(info.at("name"), "Symrig Loopback");
  EXPECT_EQ(info.at("serial"), serial());
  EXPECT_EQ(info.at("bus"), device_.address());
  const auto format = [&info](const char* name) -> Json {
    for (const Json& one : info.at("formats"))
      if (one.at("format") == name) return one;
    ADD_FAILURE() << name;
    return {{"bits", 0}, {"mosaic", ""}, {"read", true}};
  };
  EXPECT_EQ(format("Mono12").at("bits"), 12);
  EXPECT_EQ(format("BayerRG12").at("mosaic"), "rggb");
  EXPECT_EQ(format("RGB8").at("read"), false);
  const auto& controls = info.at("controls");
  const auto gain = std::ranges::find_if(controls, [](const Json& one) { return one.at("name") == "Gain"; });
  ASSERT_NE(gain, controls.end());
  EXPECT_EQ(gain->at("most"), 24);
  const Outcome text = symrig({"info", "--camera", path_of_camera()});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_NE(text.out.find("Mono12p"), std::string::npos) << text.out;
}

TEST_F(GenicamList, info_of_an_address_without_a_camera) {
  constexpr int kDevice = 3;
  expect_refusal({"info", "--camera", "genicam:127.9.9.9"}, kDevice, {"127.9.9.9", "check its power"});
}

}  // namespace
}  // namespace symrig::test::genicam_list_test
