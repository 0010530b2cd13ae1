// SPDX-License-Identifier: Apache-2.0
// Every number that the page marks with its source is the number of that source, and is written as it is.
#include "command.hpp"
#include "unit/report/page_reader.hpp"

#include <cmath>
#include <map>
#include <sstream>

namespace symrig::test::report_numbers_test {
namespace {

/// A shown number, and how far the true one may be: half of its last digit.
struct Shown {
  double value = 0, slack = 0;
};

std::string without(std::string text, const std::string& word, const std::string& with = "") {
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + with.size()))
    text.replace(at, word.size(), with);
  return text;
}

Shown plain(const std::string& text) {
  const std::string digits = without(text, ",");
  const std::size_t exponent = digits.find('e');
  const std::string mantissa = digits.substr(0, exponent);
  const std::size_t point = mantissa.find('.');
  const double decimals = point == std::string::npos ? 0 : static_cast<double>(mantissa.size() - point - 1);
  const double power = exponent == std::string::npos ? 0 : std::stod(digits.substr(exponent + 1));
  return {std::stod(digits), 0.5 * std::pow(10.0, power - decimals)};
}

/// "1,234", "0.52 %", "1.0e-07 %", "35 ms", "4 min 5 s", "3 h 20 min", "4.7 MB".
Shown read(const std::string& text) {
  const std::map<std::string, double> units{{"%", 0.01}, {"ms", 1e-3},    {"s", 1},     {"min", 60},
                                            {"h", 3600}, {"days", 86400}, {"bytes", 1}, {"kB", 1e3},
                                            {"MB", 1e6}, {"GB", 1e9},     {"TB", 1e12}, {"PB", 1e15}};
  std::istringstream words(without(text, "\xC2\xA0", " "));
  Shown sum;
  std::string number, unit;
  while (words >> number) {
    const double scale = words >> unit ? units.at(unit) : 1;
    const Shown one = plain(number);
    // Minutes beside hours, hours beside days are cut, not rounded.
    const bool cut = (unit == "min" || unit == "h") && sum.value > 0;
    sum = {sum.value + scale * one.value, scale * one.slack * (cut ? 2 : 1)};
  }
  return sum;
}

class ReportNumbers : public CommandTest {
 protected:
  double at(const std::string& source, const std::string& pointer) const {
    return json(source + ".json").at(nlohmann::json::json_pointer(pointer)).get<double>();
  }
  /// "capture:/a", "capture:/a - /b", "capture:sum /a 0..3".
  double truth(const std::string& from) const {
    const std::string source = from.substr(0, from.find(':'));
    const std::string rest = from.substr(from.find(':') + 1);
    if (const std::size_t minus = rest.find(" - "); minus != std::string::npos)
      return truth(source + ":" + rest.substr(0, minus)) - truth(source + ":" + rest.substr(minus + 3));
    if (!rest.starts_with("sum ")) return at(source, rest);
    const std::string array = rest.substr(4, rest.find(' ', 4) - 4);
    double sum = 0;
    for (int k = 0; k <= std::stoi(rest.substr(rest.find("..") + 2)); ++k)
      sum += at(source, array + "/" + std::to_string(k));
    return sum;
  }

  /// What the three commands say of scene.h5, and the page. Returns how many numbers were compared.
  int compare(const std::string& rig) {
    const auto run = [&](const std::vector<std::string>& arguments) {
      const Outcome outcome = symrig(arguments);
      EXPECT_EQ(outcome.code, 0) << outcome.err;
    };
    run({"inspect", "scene.h5", "--json", "inspect.json"});
    run({"evaluate", "scene.h5", "--rig", rig, "--json", "evaluate.json"});
    run({"report", "scene.h5", "-o", "report.html"});
    const PageReader page(read_text(path("report.html")));
    expect_sound(page);
    int compared = 0;
    for (const Tag& data : page.named("data")) {
      const std::string from = data.get("data-from");
      if (from.starts_with("letters:")) continue;  // report_stops_test.cpp
      const double value = std::stod(data.get("value"));
      // The page computes errors anew: sums in another order, by threads.
      EXPECT_NEAR(value, truth(from), 1e-9 * (1 + std::abs(value))) << from;
      const Shown shown = read(data.text);
      EXPECT_NEAR(shown.value, value, shown.slack * (1 + 1e-9)) << from << " is shown as " << data.text;
      ++compared;
    }
    return compared;
  }
};

TEST_F(ReportNumbers, are_those_of_capture_inspect_and_evaluate) {
  for (const char* rig : {"sim:gummy?size=16x16", "sim:vgroove-textured?size=12x17&channels=3",
                          "sim:plane?size=9x15&noise=off", "sim:views2?size=16x16"}) {
    ASSERT_EQ(symrig({"capture", "--rig", rig, "-o", "scene.h5", "--json", "capture.json", "--no-log"}).code,
              0)
        << rig;
    EXPECT_GT(compare(rig), 60) << rig;
  }
}

TEST_F(ReportNumbers, of_baselines_and_of_captures_that_stopped_early) {
  const std::string rig = "sim:gummy?size=12x12";
  const std::vector<std::vector<std::string>> ways{{"--algorithm", "paper"},
                                                   {"--algorithm", "dual"},
                                                   {"--algorithm", "brute"},
                                                   {"--max-patterns", "20"},
                                                   {"--max-patterns", "1"}};
  for (const auto& way : ways) {
    std::vector<std::string> arguments{"capture", "--rig",        rig,       "-o", "scene.h5",
                                       "--json",  "capture.json", "--no-log"};
    arguments.insert(arguments.end(), way.begin(), way.end());
    ASSERT_EQ(symrig(arguments).code, 0) << way[1];
    EXPECT_GT(compare(rig), 15) << way[1];
  }
}

TEST_F(ReportNumbers, the_file_says_when_and_how_it_was_made) {
  ASSERT_EQ(symrig({"capture", "--rig", kSmall, "-o", "scene.h5", "--json", "capture.json", "--no-log"}).code,
            0);
  const nlohmann::json told = json("capture.json");
  EXPECT_EQ(told.at("command_line"),
            std::string("symrig capture --rig '") + kSmall + "' -o scene.h5 --json capture.json --no-log");
  EXPECT_EQ(told.at("date").get<std::string>().size(), std::string("2026-01-31T23:59:58Z").size());
  EXPECT_NE(told.at("version"), "");
}

}  // namespace
}  // namespace symrig::test::report_numbers_test
