// SPDX-License-Identifier: Apache-2.0
// A misspelt word is named as what it is, with the word that was meant.
#include "command.hpp"

#include <sstream>

namespace symrig::test::misspelling_test {
namespace {

using Misspelling = CommandTest;

TEST_F(Misspelling, commands_and_options) {
  expect_refusal({"captur"}, kUsage, {"no command 'captur'", "did you mean 'capture'?", "relight"});
  expect_refusal({"--versoin"}, kUsage, {"no option '--versoin'", "did you mean '--version'?"});
  expect_refusal({"capture", "--rgi", "x"}, kUsage, {"no option '--rgi'", "did you mean '--rig'?"});
  expect_refusal({"capture", "--rgi=x", "-o", "a.h5"}, kUsage, {"'--rgi'", "'--rig'"});
  expect_refusal({"report", "a.h5", "--ouput", "x.html"}, kUsage, {"'--ouput'", "'--output'"});
  expect_refusal({"bench", "--scene", "gummy"}, kUsage, {"'--scene'", "'--scenes'"});
  expect_refusal({"flash", "a.uf2", "--verfiy"}, kUsage, {"'--verfiy'", "'--verify'"});
  expect_refusal({"inspect", "a.h5", "-x"}, kUsage, {"no option '-x'", "symrig inspect --help"});
}

// What follows an option is its value, however it looks.
TEST_F(Misspelling, a_value_is_no_option) {
  expect_refusal({"capture", "--rig", "--rgi", "-o", "a.h5"}, kUsage, {"there is no rig '--rgi'"});
  expect_refusal({"relight", "a.h5", "--light", "-1", "--ouptut", "b.png"}, kUsage, {"'--ouptut'"});
}

TEST_F(Misspelling, lights) {
  capture_small();
  const std::string help = symrig({"relight", "--help"}).out;
  std::istringstream rows(help.substr(help.find("built-in light:\n") + 16));
  std::string all;
  for (std::string row; std::getline(rows, row) && row.starts_with("  ");)
    all += (all.empty() ? "" : ", ") + row.substr(2, row.find(' ', 2) - 2);
  EXPECT_NE(all.find("letters"), std::string::npos) << help;
  expect_refusal({"relight", "scene.h5", "--light", "lettres", "-o", "a.png"}, kBadInput,
                 {"lettres", "did you mean 'letters'?", "built-in lights: " + all});
  expect_refusal({"relight", "scene.h5", "--light", "none.exr", "-o", "a.png"}, kBadInput,
                 {"none.exr", "built-in lights: white"});
}

TEST_F(Misspelling, rigs_scenes_keys_and_algorithms) {
  expect_refusal({"capture", "--rig", "gumy", "-o", "a.h5"}, kUsage, {"'gumy'", "did you mean 'sim:gummy'?"});
  expect_refusal({"capture", "--rig", "sim:gumy", "-o", "a.h5"}, kUsage, {"did you mean 'gummy'?"});
  expect_refusal({"capture", "--rig", "sim:gummy?sise=3x3", "-o", "a.h5"}, kUsage, {"did you mean 'size'?"});
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--algorithm", "burte"}, kUsage,
                 {"did you mean 'brute'?"});
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--split", "view-first"}, kUsage,
                 {"did you mean 'views-first'?"});
}

TEST_F(Misspelling, boards) {
  expect_refusal({"info", "--device", "ubs:1"}, kUsage, {"did you mean 'usb:'?"});
  expect_refusal({"info", "--device", "simm:"}, kUsage, {"did you mean 'sim:'?"});
}

TEST_F(Misspelling, sizes_that_are_too_large) {
  for (const char* size : {"100000x100000", "99999999999999999999999x3"})
    expect_refusal({"capture", "--rig", std::string("sim:gummy?size=") + size, "-o", "a.h5"}, kUsage,
                   {size, "too large", "4096x4096"});
  expect_refusal({"capture", "--rig", "sim:gummy?size=5000x5000", "-o", "a.h5"}, kFault,
                 {"16777216", "4096x4096"});
}

// The key that is there and unknown, not the one that is missing because of it.
TEST_F(Misspelling, keys_of_files) {
  write_text(path("p.toml"), "symrig = 1\n[program]\npaterns = 8\nbracket = [\"1 ms\"]\n");
  expect_refusal({"lint", "p.toml"}, kBadInput,
                 {"p.toml:3", "no key program.paterns", "did you mean 'patterns'?"});
  write_text(path("q.toml"), "symrig = 1\n[progam]\npatterns = 8\n");
  expect_refusal({"lint", "q.toml"}, kBadInput, {"q.toml:2", "no key progam", "did you mean 'program'?"});
  write_text(path("s.toml"), "symrig = 1\n[program]\nsteps = [{ hodl = \"1 ms\" }]\n");
  expect_refusal({"lint", "s.toml"}, kBadInput, {"s.toml:3", "did you mean 'hold'?"});
  write_text(path("t.toml"), "symrig = 1\n[rig.lines.x]\nrole = \"camra\"\n");
  expect_refusal({"lint", "t.toml"}, kBadInput, {"t.toml:3", "did you mean 'camera'?"});
  write_text(path("rig.toml"), "symrig = 1\n[board]\nrui = \"sim:\"\n");
  expect_refusal({"capture", "--rig", "rig.toml", "-o", "a.h5"}, kBadInput,
                 {"rig.toml:3", "no key board.rui", "did you mean 'uri'?"});
}

// A file of measured numbers that nobody reads would be taken for measured.
TEST_F(Misspelling, keys_of_a_sensor_and_of_levels) {
  const std::string rig =
      "symrig = 1\n[board]\nuri = \"sim:\"\n[camera]\nsensor = \"sensor.toml\"\n[projector]\n";
  write_text(path("rig.toml"), rig);
  write_text(path("sensor.toml"),
             "[sensor]\nbits = 12\npedestal = 64\ngain = 0.2\nread_noise = 6\nclippping = 4000\n");
  expect_refusal({"capture", "--rig", "rig.toml", "-o", "a.h5"}, kBadInput,
                 {"sensor.toml:6", "no key sensor.clippping", "did you mean 'clipping'?"});
  write_text(path("sensor.toml"), "[senser]\nbits = 12\n");
  expect_refusal({"capture", "--rig", "rig.toml", "-o", "a.h5"}, kBadInput,
                 {"sensor.toml:1", "did you mean 'sensor'?"});
  write_text(path("rig.toml"), rig + "levels = \"levels.toml\"\n");
  write_text(path("sensor.toml"), "[sensor]\nbits = 12\npedestal = 64\ngain = 0.2\nread_noise = 6\n");
  write_text(path("levels.toml"), "[levels]\nlihgt = [0, 1]\n");
  expect_refusal({"capture", "--rig", "rig.toml", "-o", "a.h5"}, kBadInput,
                 {"levels.toml:2", "did you mean 'light'?"});
}

// The fix of a bracket that is too short is a bracket.
TEST_F(Misspelling, lint_proposes_exposures_that_differ) {
  write_text(
      path("p.toml"),
      "symrig = 1\n[program]\npatterns = 8\nbracket = [\"1 us\", \"2 us\", \"4 us\", \"8 us\", \"16 us\"]\n");
  const Outcome lint = symrig({"lint", "p.toml"});
  EXPECT_EQ(lint.code, kBadInput);
  const std::size_t at = lint.out.find("bracket = [");
  ASSERT_NE(at, std::string::npos) << lint.out;
  const std::string fix = lint.out.substr(at, lint.out.find(']', at) + 1 - at);
  std::set<std::string> exposures;
  for (std::size_t begin = fix.find('"'); begin != std::string::npos; begin = fix.find('"', begin + 1)) {
    const std::size_t end = fix.find('"', begin + 1);
    exposures.insert(fix.substr(begin, end - begin));
    begin = end;
  }
  EXPECT_EQ(exposures.size(), 5U) << fix;
  write_text(path("p.toml"), "symrig = 1\n[program]\npatterns = 8\n" + fix + "\n");
  EXPECT_EQ(symrig({"lint", "p.toml"}).code, 0) << fix;
}

}  // namespace
}  // namespace symrig::test::misspelling_test
