// SPDX-License-Identifier: Apache-2.0
// Every option of every command, found in its help: values that are none end with one line and exit code 2.
#include "command.hpp"
#include "symrig/acquisition/algorithms.hpp"

#include <array>
#include <cstdlib>
#include <regex>
#include <sstream>
#include <string_view>

namespace symrig::test::option_values_test {
namespace {

using Words = std::vector<std::string>;

struct Option {
  std::string name, type;
};

class OptionValues : public CommandTest {
 protected:
  /// Commands, as the help of symrig lists them.
  Words commands() const {
    Words names;
    bool listed = false;
    std::istringstream help(symrig({"--help"}).out);
    for (std::string line; std::getline(help, line);) {
      if (line.starts_with("Subcommands:")) listed = true;
      std::smatch name;
      if (listed && std::regex_search(line, name, std::regex("^  ([a-z]+) "))) names.push_back(name[1]);
      if (listed && line.empty()) break;
    }
    return names;
  }
  /// Options that take a value: "--tolerance X".
  std::vector<Option> options_of(const std::string& command) const {
    std::vector<Option> options;
    std::istringstream help(symrig({command, "--help"}).out);
    for (std::string line; std::getline(help, line);) {
      std::smatch found;
      if (std::regex_search(line, found, std::regex("^  (?:-\\w,)?(--[a-z-]+) ([^ ]+)"))) {
        if (found[1] != "--help" && found[2] != "Excludes:") options.push_back({found[1], found[2]});
      }
    }
    return options;
  }
  Outcome expect_one_line(const Words& words) const {
    Outcome outcome = symrig(words);
    std::string all;
    for (const std::string& word : words) all += word + " ";
    EXPECT_EQ(outcome.code, kUsage) << all << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << all << outcome.err;
    EXPECT_EQ(outcome.out, "") << all;
    EXPECT_TRUE(files().empty()) << all;
    return outcome;
  }
  /// What a command needs before it looks at its numbers.
  static Words needed(const std::string& command) {
    if (command == "capture") return {"--rig", kSmall, "--output", "a.h5"};
    if (command == "relight" || command == "dual") return {"a.h5", "--light", "white", "--output", "a.png"};
    if (command == "fit") return {"--from", ".", "--output", "a.h5"};
    if (command == "merge") return {".", "--output", "a.exr"};
    if (command == "serve") return {"sim:", "--listen", "unix:a.sock"};
    if (command == "import") return {"a.npy", "--output", "b.h5"};
    if (command == "export") return {"a.h5", "--dense", "b.npy"};
    if (command == "flash") return {"a.uf2"};
    if (command == "view") return {"a.h5"};
    if (command == "report" || command == "compile") return {"a", "--output", "b"};
    if (command == "conformance") return {"sim:"};
    const std::set<std::string> of_a_file{"evaluate", "inspect", "lint", "run", "trace"};
    if (of_a_file.contains(command)) return {"a"};
    if (command == "identify" || command == "selftest") return {"--device", "sim:"};
    return {};
  }
  static Words without(Words words, const std::string& option) {
    const auto at = std::find(words.begin(), words.end(), option);
    if (at != words.end()) words.erase(at, at + 2);
    return words;
  }
};

TEST_F(OptionValues, no_option_takes_nothing) {
  std::size_t tried = 0;
  for (const std::string& command : commands())
    for (const Option& option : options_of(command)) {
      Words words{command};
      for (const std::string& word : without(needed(command), option.name)) words.push_back(word);
      words.insert(words.end(), {option.name, ""});
      const Outcome outcome = expect_one_line(words);
      const bool told = outcome.err.find(option.name + " is empty") != std::string::npos ||
                        outcome.err.find(option.name + ": ''") != std::string::npos;
      EXPECT_TRUE(told) << command << " " << outcome.err;
      ++tried;
    }
  EXPECT_GT(tried, 50U);
}

constexpr std::array<std::string_view, 14> kNoNumbers{
    "nan",     "-nan", "inf", "-inf", "1e999", "99999999999999999999", "-1e-9", "0x10p",
    "12three", " ",    "1,5", "--",   "1e",    "-99999999999999999999"};

// Every option meets five of the values. They take turns, so that every value meets several options. With
// SYMRIG_LONG, every option meets all.
TEST_F(OptionValues, no_number_is_taken_for_another) {
  const std::set<std::string> numbers{"N", "X", "S", "E"};
  const std::size_t each = std::getenv("SYMRIG_LONG") != nullptr ? kNoNumbers.size() : 5;
  std::size_t turn = 0;
  for (const std::string& command : commands())
    for (const Option& option : options_of(command)) {
      if (!numbers.contains(option.type)) continue;
      for (std::size_t k = 0; k < each; ++k) {
        const std::string_view value = kNoNumbers.at(turn++ % kNoNumbers.size());
        if (option.type != "N" && value == "99999999999999999999") continue;  // a factor may be so
        Words words{command};
        for (const std::string& word : needed(command)) words.push_back(word);
        words.push_back(option.name + "=" + std::string(value));
        expect_one_line(words);
      }
    }
  EXPECT_GT(turn, 4 * kNoNumbers.size());  // each value has met four options
}

// 010 is no eight, and 2^64 no 2^63 - 1.
TEST_F(OptionValues, whole_numbers_are_decimal) {
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--max-patterns", "0x10"}, kUsage, {"'0x10'"});
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--max-patterns", "18446744073709551616"}, kUsage,
                 {"'18446744073709551616' is too large", "9223372036854775807"});
  for (const char* zero : {"09", "010"})
    expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--max-patterns", zero}, kUsage,
                   {"begins with a zero"});
}

// Whoever gives an option expects something of it: one that changes nothing is refused.

class IdleOptions : public CommandTest {
 protected:
  /// A capture with these options is refused, and says why.
  void expect_idle(Words options, const std::string& idle, const std::string& why) const {
    // On a rig that plans, --photograph-seconds has an effect.
    Words words{"capture", "--rig", std::string(kSmall) + "&exposures=4", "-o", "a.h5"};
    words.insert(words.end(), options.begin(), options.end());
    expect_refusal(words, kUsage, {idle + " has no effect", why});
  }
};

TEST_F(IdleOptions, capture_with_another_algorithm) {
  expect_idle({"--algorithm", "brute", "--tolerance", "0.01"}, "--tolerance", "--algorithm brute");
  expect_idle({"--algorithm", "dual", "--tolerance", "0.01", "--dual-threshold", "0.1"}, "--tolerance",
              "--dual-threshold");
  for (const AlgorithmInfo& one : algorithms()) {
    if (one.algorithm == Algorithm::dual) continue;
    const std::string algorithm(one.name);
    expect_idle({"--algorithm", algorithm, "--dual-threshold", "0.1"}, "--dual-threshold", algorithm);
    expect_idle({"--algorithm", algorithm, "--dual-subtract"}, "--dual-subtract", algorithm);
  }
  for (const AlgorithmInfo& one : algorithms()) {
    if (one.hierarchical) continue;
    const std::string algorithm(one.name);
    expect_idle({"--algorithm", algorithm, "--polish", "2"}, "--polish", algorithm);
    expect_idle({"--algorithm", algorithm, "--max-patterns", "9"}, "--max-patterns", algorithm);
    expect_idle({"--algorithm", algorithm, "--max-seconds", "9"}, "--max-seconds", algorithm);
    expect_idle({"--algorithm", algorithm, "--photograph-seconds", "9"}, "--photograph-seconds", algorithm);
  }
  for (const AlgorithmInfo& one : algorithms()) {
    const std::string algorithm(one.name);
    if (!one.economy.checks)
      expect_idle({"--algorithm", algorithm, "--target-error", "0.1"}, "--target-error", algorithm);
    if (!one.splits_views) expect_idle({"--algorithm", algorithm, "--split", "flat"}, "--split", algorithm);
  }
}

TEST_F(IdleOptions, capture_on_another_rig) {
  expect_idle({"--split", "flat"}, "--split", "one view");
  expect_idle({"--photograph-seconds", "5"}, "--photograph-seconds", "fixed exposures");
}

TEST_F(IdleOptions, those_that_have_an_effect_are_taken) {
  const std::string views = "sim:views2?size=8x8&noise=off", planned = "sim:plane?size=8x8&exposures=auto";
  for (const Words& words : std::vector<Words>{{"--rig", views, "--split", "flat"},
                                               {"--rig", planned, "--photograph-seconds", "5"},
                                               {"--rig", kSmall, "--algorithm", "paper", "--polish", "1"},
                                               {"--rig", kSmall, "--algorithm", "dual", "--tolerance", "0.1"},
                                               {"--rig", kSmall, "--target-error", "0.5"}}) {
    Words all{"capture", "-o", "a.h5"};
    all.insert(all.end(), words.begin(), words.end());
    const Outcome outcome = symrig(all);
    EXPECT_EQ(outcome.code, 0) << words[2] << ": " << outcome.err;
  }
}

TEST_F(IdleOptions, relight) {
  capture_small();
  expect_refusal({"relight", "scene.h5", "--light", "white", "-o", "a.exr", "--views", "2x2"}, kUsage,
                 {"--views has no effect"});
  expect_refusal({"dual", "scene.h5", "--light", "white", "-o", "a.pfm", "--exposure", "2"}, kUsage,
                 {"--exposure applies to .png only"});
}

TEST_F(IdleOptions, ports_of_pages) {
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--port", "8080"}, kUsage,
                 {"--port has no effect", "without --watch"});
  expect_refusal({"view", "a.h5", "--export", "a.html", "--port", "8080"}, kUsage, {"--port has no effect"});
}

TEST_F(IdleOptions, flash_and_calibrate) {
  for (const Words& more :
       std::vector<Words>{{"--device", "sim:"}, {"--drive", "."}, {"--wait", "1"}, {"--again"}}) {
    Words words{"flash", "a.uf2", "--verify"};
    words.insert(words.end(), more.begin(), more.end());
    expect_refusal(words, kUsage, {more.front() + " has no effect with --verify"});
  }
  expect_refusal({"calibrate", "--rig", kSmall, "--projector", "12x17"}, kUsage,
                 {"--projector has no effect"});
  expect_refusal({"calibrate", "--sensor", ".", "--report", "m.html"}, kUsage, {"--report has no effect"});
  expect_refusal({"calibrate", "--sensor", ".", "--uncertainty", "u.exr"}, kUsage,
                 {"--uncertainty has no effect"});
}

TEST_F(IdleOptions, trace) {
  write_text(path("p.toml"), "symrig = 1\n[program]\npatterns = 2\nbracket = [\"1 ms\"]\n");
  ASSERT_EQ(symrig({"compile", "p.toml", "-o", "p.symprog"}).code, 0);
  ASSERT_EQ(symrig({"run", "p.toml", "--device", "sim:", "-o", "r.json"}).code, 0);
  expect_refusal({"trace", "p.symprog", "--board", "sim:"}, kUsage, {"--board has no effect"});
  expect_refusal({"trace", "r.json", "--board", "sim:"}, kUsage, {"--board has no effect"});
  expect_refusal({"trace", "r.json", "--max-edges", "5"}, kUsage, {"--max-edges has no effect"});
  expect_refusal({"trace", "r.json", "--actual"}, kUsage, {"--actual has no effect"});
  expect_refusal({"trace", "r.json", "--plan", "--actual", "--vcd", "-"}, kUsage, {"--plan has no effect"});
  EXPECT_EQ(symrig({"trace", "p.toml", "--board", "sim:", "--max-edges", "5"}).code, 0);
  expect_refusal({"trace", "p.toml", "--board", "sim:", "--max-edges", "0"}, kUsage,
                 {"'0' is too small; give 1 to"});
  EXPECT_EQ(symrig({"trace", "r.json", "--actual", "--vcd", "-"}).code, 0);
}

TEST_F(IdleOptions, bench) {
  expect_refusal({"bench", "--algorithms", "symrig", "--tolerances", "paper:1e-3"}, kUsage,
                 {"--tolerances paper:", "no effect"});
  expect_refusal({"bench", "--algorithms", "brute", "--tolerances", "1e-3"}, kUsage,
                 {"--tolerances", "no effect"});
  expect_refusal({"bench", "--quick", "--size", "8x8", "--seeds", "1", "--tolerances", "1e-3"}, kUsage,
                 {"--quick has no effect"});
}

// A misspelt word is named as what it is, with the word that was meant.

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
}  // namespace symrig::test::option_values_test
