// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"

namespace symrig::test::usage_test {
namespace {

using Usage = CommandTest;

const std::vector<std::string> kCommands{"capture",   "relight", "dual",  "evaluate", "inspect", "report",
                                         "calibrate", "fit",     "bench", "list",     "info",    "identify",
                                         "selftest",  "flash",   "lint",  "compile",  "run",     "trace"};

TEST_F(Usage, help_names_every_command_and_exit_code) {
  const Outcome help = symrig({"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.err, "");
  for (const std::string& command : kCommands)
    EXPECT_NE(help.out.find("  " + command), std::string::npos) << command;
  EXPECT_NE(help.out.find("Example"), std::string::npos);
  EXPECT_NE(help.out.find("0 done, 2 usage, 3 device, 4 bad input, 5 fault or limit"), std::string::npos);
}

TEST_F(Usage, each_command_teaches_itself) {
  for (const std::string& command : kCommands) {
    const Outcome help = symrig({command, "--help"});
    EXPECT_EQ(help.code, 0) << command;
    EXPECT_NE(help.out.find("Example:\n  symrig " + command), std::string::npos) << help.out;
    EXPECT_NE(help.out.find("Exit codes: 0 done"), std::string::npos) << command;
  }
}

TEST_F(Usage, capture_help_names_every_scene_and_algorithm) {
  const std::string help = symrig({"capture", "--help"}).out;
  for (const char* word : {"plane", "vgroove-white", "vgroove-mixed", "vgroove-textured", "gummy", "occluder",
                           "mirror", "views2", "views3", "paper", "dual", "brute"})
    EXPECT_NE(help.find(word), std::string::npos) << word;
}

TEST_F(Usage, version_is_told) {
  const Outcome version = symrig({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_TRUE(version.out.starts_with("symrig 0.")) << version.out;
}

TEST_F(Usage, no_command_is_a_usage_error) {
  expect_refusal({}, kUsage, {"capture", "report", "--help"});
}

// Commands that the design promises for later must not pretend to exist.
TEST_F(Usage, commands_that_do_not_exist_are_refused_with_those_that_do) {
  for (const char* word : {"view", "Capture", "nonsense"})
    expect_refusal({word}, kUsage, {std::string("'") + word + "'", "capture, relight, dual, evaluate"});
}

TEST_F(Usage, unknown_and_missing_options_are_one_line) {
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--fast"}, kUsage,
                 {"symrig capture", "--fast", "--help"});
  expect_refusal({"capture", "--rig", kSmall}, kUsage, {"--output"});
  expect_refusal({"capture", "-o", "a.h5"}, kUsage, {"--rig"});
  expect_refusal({"relight", "a.h5", "-o", "a.exr"}, kUsage, {"--light"});
  expect_refusal({"relight", "--light", "white", "-o", "a.exr"}, kUsage, {"scene"});
  expect_refusal({"dual", "a.h5", "--light", "white"}, kUsage, {"--output"});
  expect_refusal({"evaluate"}, kUsage, {"scene"});
  expect_refusal({"inspect"}, kUsage, {"scene"});
  expect_refusal({"report", "a.h5"}, kUsage, {"--output"});
  expect_refusal({"fit", "-o", "a.h5"}, kUsage, {"--from"});
  expect_refusal({"calibrate"}, kUsage, {"--from", "--rig"});
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--tolerance", "much"}, kUsage, {"much"});
}

}  // namespace
}  // namespace symrig::test::usage_test
