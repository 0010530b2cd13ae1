// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "symrig/acquisition/algorithms.hpp"
#include "unit/report/page_reader.hpp"

#include <cmath>
#include <map>
#include <optional>
#include <sstream>

#include <fmt/format.h>

namespace symrig::test::report_test {
namespace {

using Report = CommandTest;

std::size_t count(const std::string& text, const std::string& word) {
  std::size_t n = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++n;
  return n;
}

/// Nothing on the page asks anybody for anything: every src is a data URI, no link, no script, no style from
/// elsewhere.
void expect_self_contained(const std::string& page) {
  EXPECT_EQ(count(page, "src=\""), count(page, "src=\"data:image/png;base64,"));
  for (const char* word : {"http:", "https:", "<script", "<link", "@import", "url(", "onload", "<iframe"})
    EXPECT_EQ(count(page, word), 0U) << word;
}

TEST_F(Report, of_a_simulated_scene_shows_all_that_was_promised) {
  capture_small();
  const Outcome outcome = symrig({"report", "scene.h5", "-o", "report.html"});
  ASSERT_EQ(outcome.code, 0) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  const std::string page = read_text(path("report.html"));
  expect_self_contained(page);
  for (const char* words :
       {"flood-lit", "A vertical bar", "Letters", "Ground truth", "A slice of T", "The level of the leaf",
        "Stopped at each level", "brute force", "frobenius", "indirect", "flood", "relight, natural",
        "simulated capture time", "rank-1", "subdivided"})
    EXPECT_GT(count(page, words), 0U) << words;
  // The scene 3, flood-lit 3, bar 4, bar exposed for indirect light 2, letters 4, slice 3, maps over the
  // picture 2, one for each of the six levels, and four for each of the four held-out photographs that are
  // shown.
  EXPECT_EQ(count(page, "<img"), 3U + 3U + 4U + 2U + 4U + 3U + 2U + 6U + 4U * 4U);
  EXPECT_EQ(count(page, "src=\"data:image/png;base64,\""), 0U);  // no picture is empty
}

TEST_F(Report, every_algorithm_and_colour_have_one) {
  for (const std::string_view algorithm : algorithm_names()) {
    ASSERT_EQ(symrig({"capture", "--rig", std::string(kSmall) + "&channels=3", "-o", "scene.h5",
                      "--algorithm", std::string(algorithm)})
                  .code,
              0);
    const Outcome outcome = symrig({"report", "scene.h5", "-o", "report.html"});
    ASSERT_EQ(outcome.code, 0) << outcome.err;
    expect_self_contained(read_text(path("report.html")));
  }
}

TEST_F(Report, of_the_smallest_grids_works) {
  for (const char* size : {"1x1", "1x5", "7x1"}) {
    const std::string rig = std::string("sim:plane?noise=off&size=") + size;
    ASSERT_EQ(symrig({"capture", "--rig", rig, "-o", "scene.h5"}).code, 0) << size;
    const Outcome outcome = symrig({"report", "scene.h5", "-o", "report.html"});
    EXPECT_EQ(outcome.code, 0) << size << ": " << outcome.err;
  }
}

TEST_F(Report, bad_input_is_refused) {
  expect_refusal({"report", "none.h5", "-o", "report.html"}, kBadInput, {"none.h5"});
  capture_small();
  expect_refusal({"report", "scene.h5", "-o", "missing/report.html"}, kBadInput, {"missing/report.html"});
  expect_refusal({"report", "scene.h5", "-o", "/proc/report.html"}, kBadInput, {"/proc/report.html"});
}

// Every number that the page marks with its source is the number of that source, and is written as it is.

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

// What the page says of a capture that stops at a level is what a capture that stops there gives.

struct Stop {
  double patterns = 0;
  std::optional<double> estimate;  ///< relative error of T
  std::optional<double> letters;   ///< relative error of the picture under the letters
};

class ReportStops : public CommandTest {
 protected:
  /// The page of scene.h5: marked numbers by their source.
  std::map<std::string, double> page() {
    EXPECT_EQ(symrig({"report", "scene.h5", "-o", "report.html"}).code, 0);
    std::map<std::string, double> numbers;
    for (const Tag& data : PageReader(read_text(path("report.html"))).named("data"))
      numbers[data.get("data-from")] = std::stod(data.get("value"));
    return numbers;
  }
  void capture(const std::string& rig, const std::vector<std::string>& budget) {
    std::vector<std::string> arguments{"capture", "--rig",        rig,       "-o", "scene.h5",
                                       "--json",  "capture.json", "--no-log"};
    arguments.insert(arguments.end(), budget.begin(), budget.end());
    ASSERT_EQ(symrig(arguments).code, 0);
  }
  double true_error(const std::string& rig) {
    EXPECT_EQ(symrig({"evaluate", "scene.h5", "--rig", rig, "--json", "errors.json"}).code, 0);
    return json("errors.json").at("error").at("frobenius");
  }
  /// Of the last picture: the finished tensor.
  static double last_letters(const std::map<std::string, double>& numbers) {
    int k = 0;
    while (numbers.contains("letters:/stopped/" + std::to_string(k + 1))) ++k;
    return numbers.at("letters:/stopped/" + std::to_string(k));
  }
  /// One for each picture of "Stopped at each level": the one before the levels, then one a level.
  static std::vector<Stop> stops(const std::map<std::string, double>& numbers) {
    std::vector<Stop> all;
    for (int k = 0;; ++k) {
      const auto letters = numbers.find("letters:/stopped/" + std::to_string(k));
      if (letters == numbers.end()) return all;
      const std::string step = "capture:/steps/" + std::to_string(k - 1);
      Stop stop{numbers.at(k == 0 ? "capture:/patterns_per_level/0" : step + "/patterns"), std::nullopt,
                letters->second};
      if (k > 0) stop.estimate = numbers.at(step + "/error");
      all.push_back(stop);
    }
  }
};

// Bounds. The estimate comes from one vector z of random signs: its square is ‖Ez‖² / ‖Tz‖², where E = T~ −
// T. ‖Ez‖² has mean ‖E‖² (Frobenius) and variance 2 (‖EᵀE‖² − Σ (EᵀE)ᵢᵢ²) ≤ 2 ‖E‖⁴. `evaluate` takes the mean
// of 12 such vectors. So in the worst case, E of rank 1, the squares differ by (√2 + √(2/12)) of themselves a
// standard deviation; errors of many blocks come nowhere near. A quarter of the error is four deviations
// where EᵀE has 128 equal eigenvalues: the squares then deviate by √(2/128) = 12.5 %, the errors by 6.25 %.
// The last step errs less in truth: the direct light is refitted after it, which the estimate does not know
// yet. The picture: page and stopped capture make it of the same sums of T, each measured as well as its
// capture measures: they differ by at most what both err when all levels are done.
TEST_F(ReportStops, agree_with_captures_whose_budget_ends_there) {
  for (const char* rig : {"sim:gummy?size=32x32", "sim:vgroove-textured?size=24x32&channels=3",
                          "sim:mirror?size=32x32&seed=3"}) {
    capture(rig, {});
    const std::vector<Stop> told = stops(page());
    ASSERT_GE(told.size(), 5U) << rig;
    const auto errors = json("capture.json").at("error_per_level").get<std::vector<double>>();
    const auto widths = json("capture.json").at("error_per_level_uncertainty").get<std::vector<double>>();
    const double finished = *told.back().letters;
    std::vector<double> really;
    for (std::size_t k = 0; k < told.size(); ++k) {
      // A budget of patterns, or a target alone, would make all levels coarser (docs/research/budgets.md); a
      // budget that no tolerance fits into ends after its level. It serves where the first level leaves no
      // error that can be asked for.
      const double reached = k == 0 ? 1 : errors[k - 1] + widths[k - 1];
      if (reached < 1)
        capture(rig, {"--target-error", fmt::format("{:.17g}", reached), "--tolerance", "0.0003"});
      else
        capture(rig, {"--max-patterns", std::to_string(static_cast<int>(told[k].patterns))});
      const nlohmann::json per_level = json("capture.json").at("error_per_level");
      ASSERT_EQ(per_level.size(), k) << rig;
      really.push_back(last_letters(page()));
      if (k == 0) continue;
      EXPECT_EQ(*told[k].estimate, per_level.back().get<double>())
          << rig << ", stopped after level " << k - 1;
      const double error = true_error(rig);
      EXPECT_LT(error, 1.25 * *told[k].estimate) << rig << ", stopped after level " << k - 1;
      const bool last = k + 1 == told.size();
      EXPECT_GT(error, last ? 0 : 0.75 * *told[k].estimate) << rig << ", stopped after level " << k - 1;
    }
    for (std::size_t k = 0; k < told.size(); ++k)
      EXPECT_NEAR(*told[k].letters, really[k], finished + really.back())
          << rig << ", stopped after level " << static_cast<int>(k) - 1;
  }
}

}  // namespace
}  // namespace symrig::test::report_test
