// SPDX-License-Identifier: Apache-2.0
// What the page says of a capture that stops at a level is what a capture that stops there gives.
#include "command.hpp"
#include "unit/report/page_reader.hpp"

#include <map>
#include <optional>

#include <fmt/format.h>

namespace symrig::test::report_stops_test {
namespace {

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
}  // namespace symrig::test::report_stops_test
