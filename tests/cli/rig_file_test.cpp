// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

#include <fstream>

namespace symrig::test::rig_file_test {
namespace {

using RigFileCommand = CommandTest;

constexpr const char* kSensor =
    "[camera]\nbits = 12\nfull_well = 20000\nread_noise = 6\npedestal = 64\n[projector]\n";

TEST_F(RigFileCommand, a_file_that_is_not_there_is_bad_input) {
  const Outcome outcome = symrig({"capture", "--rig", "rig.toml", "-o", "scene.h5"});
  EXPECT_EQ(outcome.code, 4);
  EXPECT_EQ(outcome.err, "symrig capture: there is no rig file rig.toml; check the path\n");
  EXPECT_EQ(symrig({"capture", "--rig", "gummy", "-o", "scene.h5"}).code, 2);
}

TEST_F(RigFileCommand, a_mistake_in_it_is_named_with_its_line) {
  std::ofstream(path("rig.toml")) << "symrig = 1\n[board]\nurl = \"usb:\"\n" << kSensor;
  for (const char* command : {"capture", "calibrate"}) {
    const std::string output = std::string(command) == "capture" ? "scene.h5" : "out.exr";
    const Outcome outcome = symrig({command, "--rig", "rig.toml", "-o", output});
    EXPECT_EQ(outcome.code, 4) << command;
    EXPECT_NE(outcome.err.find("rig.toml:3: there is no key board.url; did you mean 'uri'?"),
              std::string::npos)
        << outcome.err;
  }
  EXPECT_EQ(files(), std::set<std::string>{"rig.toml"});
}

TEST_F(RigFileCommand, a_board_that_is_not_there_is_a_device_error) {
  std::ofstream(path("rig.toml")) << "symrig = 1\n[board]\nuri = \"unix:no-board.sock\"\n" << kSensor;
  const Outcome outcome = symrig({"capture", "--rig", "rig.toml", "-o", "scene.h5"});
  EXPECT_EQ(outcome.code, 3) << outcome.err;
  EXPECT_NE(outcome.err.find("no-board.sock"), std::string::npos) << outcome.err;
  EXPECT_EQ(files(), std::set<std::string>{"rig.toml"});
}

TEST_F(RigFileCommand, trouble_is_told_and_a_missing_rig_named) {
  ASSERT_EQ(symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--json", "capture.json"}).code, 0);
  const nlohmann::json trouble = json("capture.json").at("trouble");
  EXPECT_EQ(trouble.at("photographs_retaken"), 0);
  EXPECT_EQ(trouble.at("frames").at("missing"), 0);
  EXPECT_GT(trouble.at("frames").at("certain").get<std::int64_t>(), 0);
  const Outcome outcome = symrig({"evaluate", "scene.h5", "--rig", "nothing.toml"});
  EXPECT_EQ(outcome.code, 4) << outcome.err;
}

}  // namespace
}  // namespace symrig::test::rig_file_test
