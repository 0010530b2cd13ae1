// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/acquisition/algorithms.hpp"
#include "symrig/sim/scene.hpp"

namespace symrig::test::usage_test {
namespace {

using Usage = CommandTest;

struct Command {
  std::string name, about;
};
const std::vector<Command> kCommands{
#define SYMRIG_COMMAND_ROW(name, about) {#name, about},
#include "../../host/apps/commands.def"
#undef SYMRIG_COMMAND_ROW
};

TEST_F(Usage, help_names_every_command_and_exit_code) {
  const Outcome help = symrig({"--help"});
  EXPECT_EQ(help.code, 0);
  EXPECT_EQ(help.err, "");
  for (const Command& command : kCommands) {
    const std::size_t line = help.out.find("  " + command.name + " ");
    ASSERT_NE(line, std::string::npos) << command.name;
    const std::string rest = help.out.substr(line, help.out.find('\n', line) - line);
    EXPECT_TRUE(rest.ends_with(" " + command.about)) << rest;
  }
  EXPECT_NE(help.out.find("Example"), std::string::npos);
  EXPECT_NE(help.out.find("0 done, 2 usage, 3 device, 4 bad input, 5 fault or limit"), std::string::npos);
}

TEST_F(Usage, each_command_teaches_itself) {
  for (const auto& [command, about] : kCommands) {
    const Outcome help = symrig({command, "--help"});
    EXPECT_EQ(help.code, 0) << command;
    EXPECT_NE(help.out.find(about), std::string::npos) << command;
    EXPECT_NE(help.out.find("Example:\n  symrig " + command), std::string::npos) << help.out;
    EXPECT_NE(help.out.find("Exit codes: 0 done"), std::string::npos) << command;
  }
}

TEST_F(Usage, capture_help_has_every_row_of_the_tables) {
  const std::string help = symrig({"capture", "--help"}).out;
  const std::size_t tables = help.find("Algorithms:");
  ASSERT_NE(tables, std::string::npos);
  const auto expect_row = [&help, tables](std::string_view name, std::string_view text) {
    const std::size_t line = help.find("\n  " + std::string(name) + " ", tables);
    ASSERT_NE(line, std::string::npos) << name;
    const std::string rest = help.substr(line + 1, help.find('\n', line + 1) - line - 1);
    EXPECT_NE(rest.find(text), std::string::npos) << rest;
  };
  for (const SceneInfo& scene : scenes()) expect_row(scene.name, scene.about);
  for (const SceneKey& key : scene_keys()) {
    expect_row(std::string(key.name) + "=" + key.standard, key.meaning);
    expect_row(std::string(key.name) + "=" + key.standard, "(" + key.values + ")");
  }
  for (const AlgorithmInfo& one : algorithms())  // the help wraps its lines
    expect_row(one.name, one.description.substr(0, one.description.find(';')));
}

TEST_F(Usage, version_is_told) {
  const Outcome version = symrig({"--version"});
  EXPECT_EQ(version.code, 0);
  EXPECT_TRUE(version.out.starts_with("symrig 0.")) << version.out;
  EXPECT_EQ(symrig({"-V"}).out, version.out);
}

TEST_F(Usage, help_command_prints_what_the_option_prints) {
  EXPECT_EQ(symrig({"help"}).out, symrig({"--help"}).out);
  for (const Command& command : kCommands) {
    const Outcome help = symrig({"help", command.name});
    EXPECT_EQ(help.code, 0) << command.name;
    EXPECT_EQ(help.out, symrig({command.name, "--help"}).out);
  }
  expect_refusal({"help", "captur"}, kUsage, {"'captur'", "did you mean 'capture'?"});
}

TEST_F(Usage, no_command_is_a_usage_error) {
  const Outcome alone = symrig({});
  EXPECT_EQ(alone.code, kUsage);
  EXPECT_EQ(alone.out, "");
  // What it is for, how to begin, and the commands: no more than fits on a screen.
  for (const char* part : {"measures how a real scene transports light", "symrig capture --rig",
                           "Commands: capture, relight", "symrig: no command given; see symrig --help\n"})
    EXPECT_NE(alone.err.find(part), std::string::npos) << part << "\n" << alone.err;
  EXPECT_LT(std::ranges::count(alone.err, '\n'), 20);
}

// Commands that the design promises for later must not pretend to exist.
TEST_F(Usage, commands_that_do_not_exist_are_refused_with_those_that_do) {
  for (const char* word : {"mingle", "Capture", "nonsense"})
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
  expect_refusal({"merge", "-o", "a.exr"}, kUsage, {"folder"});
  expect_refusal({"calibrate"}, kUsage, {"--from", "--rig"});
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--tolerance", "much"}, kUsage, {"much"});
}

}  // namespace
}  // namespace symrig::test::usage_test
