// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

#include <string>
#include <vector>

namespace symrig::conformance_test {
namespace {

class ConformanceCommand : public test::CommandTest {};

TEST_F(ConformanceCommand, simulated_board_passes) {
  const test::Outcome outcome = symrig({"conformance", "sim:", "--json", "checks.json"});
  EXPECT_EQ(outcome.code, 0) << outcome.out << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_NE(outcome.out.find("pass  wire.corrupted\n"), std::string::npos);
  EXPECT_NE(outcome.out.find("skip  jumper.stamps: needs a jumper from an output to an input\n"),
            std::string::npos);
  const nlohmann::json told = json("checks.json");
  EXPECT_EQ(told["failed"], 0);
  EXPECT_EQ(told["passed"].get<int>() + told["skipped"].get<int>(), static_cast<int>(told["checks"].size()));
  EXPECT_GT(told["passed"].get<int>(), 90);
}

TEST_F(ConformanceCommand, filter) {
  const test::Outcome outcome = symrig({"conformance", "sim:", "--filter", "^clock"});
  EXPECT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.out.find("wire."), std::string::npos);
  EXPECT_NE(outcome.out.find("4 passed, 0 failed, 0 skipped"), std::string::npos) << outcome.out;
}

TEST_F(ConformanceCommand, nothing_to_check_is_no_success) {
  const test::Outcome outcome = symrig({"conformance", "sim:", "--filter", "^jumper"});
  EXPECT_EQ(outcome.code, 2);
  EXPECT_NE(outcome.err.find("all checks were skipped"), std::string::npos) << outcome.err;
}

TEST_F(ConformanceCommand, wrong_options) {
  expect_refusal({"conformance", "sim:", "--filter", "("}, 2, {"regular expression"});
  expect_refusal({"conformance", "sim:", "--filter", "nonsense"}, 2, {"nonsense", "docs/conformance.md"});
  expect_refusal({"conformance", "sim:", "--jumper", "lamp"}, 2, {"OUTPUT:INPUT"});
  expect_refusal({"conformance", "sim:", "--jumper", "lamp:vsync"}, 2, {"lamp", "projector_trigger"});
  expect_refusal({"conformance", "nowhere:"}, 2, {"nowhere"});
  setenv("SYMRIG_DEVICE", "nonsense:", 1);
  expect_refusal({"conformance"}, 2, {"nonsense"});
  unsetenv("SYMRIG_DEVICE");
}

}  // namespace
}  // namespace symrig::conformance_test

namespace symrig::test::conformance_test {
namespace {

// symrig selftest --fixture: the production test with a plug.

using Json = nlohmann::json;

const std::string kPlugged =
    "sim:?jumper=projector_trigger:vsync,camera_trigger:camera_strobe,lamp_enable:interlock";

class Fixture : public CommandTest {
 protected:
  static constexpr int kDevice = 3;

  static std::vector<std::string> command(const std::string& device,
                                          const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"selftest", "--fixture", "--device", device, "--pings", "1"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
};

TEST_F(Fixture, tests_every_wire_and_writes_a_results_file) {
  std::filesystem::create_directory(path("results"));
  const Outcome outcome = symrig(command(kPlugged, {"--results", "results", "--revision", "B2"}));
  ASSERT_EQ(outcome.code, 0) << outcome.err << outcome.out;
  EXPECT_NE(outcome.out.find("ok   crossing   3 pulses, each at its own input only"), std::string::npos)
      << outcome.out;
  std::vector<std::filesystem::path> written;
  for (const auto& entry : std::filesystem::directory_iterator(path("results")))
    written.push_back(entry.path());
  ASSERT_EQ(written.size(), 1U);
  EXPECT_TRUE(written[0].filename().string().starts_with("sim-73696d2d30303031-20")) << written[0];
  const Json test = Json::parse(read_text(written[0]));
  EXPECT_EQ(test["passed"], true);
  EXPECT_EQ(test["revision"], "B2");
  EXPECT_EQ(test["date"].get<std::string>().size(), 20U);
  EXPECT_EQ(test["firmware"]["hash"].get<std::string>().size(), 16U);
  const Json& fixture = test["fixture"];
  ASSERT_EQ(fixture["wires"].size(), 3U);
  for (const Json& wire : fixture["wires"]) EXPECT_EQ(wire["passed"], true);
  EXPECT_EQ(fixture["trip"]["interlock"], "vsync");
  EXPECT_EQ(fixture["trip"]["latency_ns"], 0.0);
  EXPECT_EQ(fixture["watchdog"]["passed"], true) << fixture["watchdog"]["text"];
  EXPECT_EQ(fixture["watchdog"]["reset_cause"], "watchdog");
  EXPECT_NEAR(fixture["watchdog"]["answered_ns"].get<double>(), 400e6, 20e6);
}

TEST_F(Fixture, an_open_wire_fails_with_its_name_and_is_on_file) {
  std::filesystem::create_directory(path("results"));
  const std::string open = "sim:?jumper=projector_trigger:vsync,lamp_enable:interlock";
  const Outcome outcome = symrig(command(open, {"--results", "results"}));
  EXPECT_EQ(outcome.code, kDevice);
  EXPECT_NE(outcome.err.find("wire camera_trigger:camera_strobe"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("no edge arrived"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::is_empty(path("results")));
}

TEST_F(Fixture, wires_that_touch_are_found) {
  const std::string touching =
      "sim:?jumper=projector_trigger:vsync,camera_trigger:camera_strobe,lamp_enable:interlock,camera_trigger:"
      "vsync";
  const Outcome outcome = symrig(command(touching));
  EXPECT_EQ(outcome.code, kDevice) << outcome.out;
  EXPECT_NE(outcome.out.find("FAIL"), std::string::npos) << outcome.out;
}

TEST_F(Fixture, another_plug_and_plugs_that_are_none) {
  const Outcome outcome = symrig(command("sim:?jumper=lamp_enable:vsync,camera_trigger:interlock",
                                         {"--plug", "lamp_enable:vsync,camera_trigger:interlock"}));
  EXPECT_EQ(outcome.code, 0) << outcome.err << outcome.out;
  expect_refusal(command(kPlugged, {"--plug", "lamp_enable:vsync"}), 2, {"at least two wires"});
  expect_refusal(command(kPlugged, {"--plug", "lamp_enable:vsync,lamp_enable:interlock"}), 2,
                 {"'lamp_enable' twice"});
  expect_refusal(command(kPlugged, {"--plug", "lamp_enable"}), 2, {"OUT:IN,OUT:IN"});
  expect_refusal(command(kPlugged, {"--plug", "lamp:vsync,camera_trigger:interlock"}), 2, {"no line 'lamp'"});
  expect_refusal(command(kPlugged, {"--results", "nowhere"}), kBadInput, {"nowhere", "make it first"});
  expect_refusal(command(kPlugged, {"--jumper", "lamp_enable:vsync"}), 2, {"--jumper", "--fixture"});
  expect_refusal({"selftest", "--device", "sim:", "--revision", "B2"}, 2, {"--revision", "--fixture"});
}

}  // namespace
}  // namespace symrig::test::conformance_test
