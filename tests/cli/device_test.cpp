// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

#include <cstdlib>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace symrig::test::device_test {
namespace {

using Json = nlohmann::json;

/// Commands that speak to a board: list, info, identify, selftest.
class Device : public CommandTest {
 protected:
  Device() { unsetenv("SYMRIG_DEVICE"); }
  ~Device() override { unsetenv("SYMRIG_DEVICE"); }
  static constexpr int kDevice = 3;
};

TEST_F(Device, list_always_shows_the_simulated_board) {
  const Outcome text = symrig({"list"});
  EXPECT_EQ(text.code, 0) << text.err;
  EXPECT_TRUE(text.out.starts_with("uri")) << text.out;
  EXPECT_NE(text.out.find("\nsim:"), std::string::npos) << text.out;
  const Outcome json = symrig({"list", "--json", "-"});
  EXPECT_EQ(json.code, 0);
  const Json last = Json::parse(json.out)["boards"].back();
  EXPECT_EQ(last["uri"], "sim:");
  EXPECT_EQ(last["board"], "sim");
  EXPECT_EQ(last["serial"], "73696d2d30303031");
  EXPECT_EQ(last["state"], "safe");
  EXPECT_EQ(last["simulated"], true);
  EXPECT_TRUE(last["error"].is_null());
  EXPECT_TRUE(Json::parse(json.out)["projectors"].is_array());
}

TEST_F(Device, list_asks_boards_behind_sockets_and_says_which_do_not_answer) {
  const Outcome outcome =
      symrig({"list", "--device", "unix:" + path("none").string(), "--device", "sim:", "--json", "-"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  const Json boards = Json::parse(outcome.out)["boards"];
  ASSERT_GE(boards.size(), 3U);
  const Json& none = boards[boards.size() - 3];
  EXPECT_TRUE(none["board"].is_null());
  EXPECT_TRUE(none["state"].is_null());
  EXPECT_NE(none["error"].get<std::string>().find("No such file"), std::string::npos);
  expect_refusal({"list", "--device", "E66"}, kUsage, {"'E66'", "usb:SERIAL"});
}

// Which cameras are there is the machine's business; that their key is there is not.
TEST_F(Device, list_has_cameras_under_their_own_key) {
  const Outcome outcome = symrig({"list", "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json cameras = Json::parse(outcome.out).at("cameras");
  ASSERT_TRUE(cameras.is_array());
  for (const Json& camera : cameras) {
    const auto node = camera["node"].get<std::string>();
    EXPECT_TRUE(node.starts_with("/dev/video") || node.starts_with("genicam:")) << node;
  }
}

TEST_F(Device, info_of_a_camera_that_is_not_there) {
  expect_refusal({"info", "--camera", "/dev/video-none"}, kDevice,
                 {"/dev/video-none is missing", "symrig list"});
  expect_refusal({"info", "--camera", "/dev/null"}, kDevice, {"/dev/null is not a V4L2 device"});
  expect_refusal({"info", "--camera", "/dev/null", "--device", "sim:"}, kUsage, {"--device"});
}

TEST_F(Device, info_tells_every_line) {
  const Outcome outcome = symrig({"info", "--device", "sim:", "--json", "-"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json info = Json::parse(outcome.out);
  EXPECT_EQ(info["command"], "info");
  EXPECT_EQ(info["tick_hz"], 125'000'000);
  EXPECT_EQ(info["reset_cause"], "power");
  EXPECT_TRUE(info["fault"].is_null());
  ASSERT_EQ(info["lines"].size(), 6U);
  EXPECT_EQ(info["lines"][0]["name"], "projector_trigger");
  EXPECT_EQ(info["lines"][0]["output"], true);
  EXPECT_EQ(info["lines"][3]["waits"]["rising"], true);
  EXPECT_EQ(info["lines"][5]["trips"], true);
  const Outcome text = symrig({"info", "--device", "sim:"});
  for (const Json& line : info["lines"])
    EXPECT_NE(text.out.find(line["name"].get<std::string>()), std::string::npos);
  EXPECT_NE(text.out.find("8 ns (125000000 a second)"), std::string::npos) << text.out;
}

TEST_F(Device, the_environment_names_the_board) {
  setenv("SYMRIG_DEVICE", "sim:", 1);
  EXPECT_EQ(symrig({"info"}).code, 0);
  expect_refusal({"info", "--device", "unix:" + path("none").string()}, kDevice, {"cannot be reached"});
  setenv("SYMRIG_DEVICE", "nonsense:", 1);
  expect_refusal({"info"}, kUsage, {"'nonsense:' is not a device"});
}

TEST_F(Device, identify_blinks) {
  const Outcome outcome = symrig({"identify", "--device", "sim:", "--seconds", "2.5"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "sim 73696d2d30303031 blinks for 3 s\n");
  expect_refusal({"identify", "--device", "sim:", "--seconds", "61"}, kUsage, {"61", "0 and 60"});
  expect_refusal({"identify", "--device", "sim:", "--seconds", "nan"}, kUsage, {"nan"});
}

TEST_F(Device, selftest_passes_and_measures_through_a_jumper) {
  const std::vector<std::string> command{"selftest", "--device",          "sim:?jumper=lamp_enable:vsync",
                                         "--jumper", "lamp_enable:vsync", "--json",
                                         "-"};
  const Outcome outcome = symrig(command);
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  const Json test = Json::parse(outcome.out);
  EXPECT_EQ(test["passed"], true);
  ASSERT_EQ(test["checks"].size(), 6U);
  ASSERT_EQ(test["pulses"].size(), 7U);
  for (const Json& pulse : test["pulses"]) EXPECT_EQ(pulse["planned_ns"], pulse["measured_ns"]);
}

/// The verdict is an exit code too, and the report is there nevertheless.
TEST_F(Device, selftest_fails_without_the_wire) {
  const Outcome outcome =
      symrig({"selftest", "--device", "sim:", "--jumper", "lamp_enable:vsync", "--pings", "1"});
  EXPECT_EQ(outcome.code, kDevice);
  EXPECT_NE(outcome.out.find("FAIL jumper"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.err.find("symrig selftest: the board failed the check 'jumper'"), std::string::npos);
}

TEST_F(Device, selftest_options_are_checked) {
  expect_refusal({"selftest", "--device", "sim:", "--jumper", "lamp_enable"}, kUsage, {"OUT:IN"});
  expect_refusal({"selftest", "--device", "sim:", "--jumper", "lamp:vsync"}, kUsage,
                 {"'lamp'", "lamp_enable"});
  expect_refusal({"selftest", "--device", "sim:", "--pings", "0"}, kUsage, {"--pings 0"});
}

}  // namespace
}  // namespace symrig::test::device_test
