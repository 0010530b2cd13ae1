// SPDX-License-Identifier: Apache-2.0
// Every option of every command, found in its help: values that are none end with one line and exit code 2.
#include "command.hpp"

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

}  // namespace
}  // namespace symrig::test::option_values_test
