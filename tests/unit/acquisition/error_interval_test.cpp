// SPDX-License-Identifier: Apache-2.0
// How often the truth lies within the interval that a capture states: seeds and sizes that nothing was tuned
// on.
#include "judged_capture.hpp"
#include "symrig/acquisition/error_estimate.hpp"

#include <array>
#include <cmath>
#include <string>

namespace symrig::error_interval_test {
namespace {

using tests::judge;
using tests::Judged;

constexpr std::array<double TransportErrors::*, 7> kErrors{
    &TransportErrors::frobenius,   &TransportErrors::indirect,       &TransportErrors::flood,
    &TransportErrors::relight_bar, &TransportErrors::relight_random, &TransportErrors::relight_natural,
    &TransportErrors::bar_indirect};

/// Counts how often the truth lies within the stated interval.
struct Coverage {
  int inside = 0, all = 0, narrow = 0;
  std::string missed;

  void add(const std::string& uri, const Judged& judged) {
    for (std::size_t k = 0; k < kErrors.size(); ++k) {
      const double value = (*judged.result.estimated).*kErrors[k];
      const double width = judged.result.estimated_half_width.*kErrors[k];
      if (std::isnan(value)) continue;
      const double truth = judged.truth.*kErrors[k];
      const bool in = std::abs(truth - value) <= width + 1e-6;
      ++all;
      inside += in ? 1 : 0;
      narrow += width < value ? 1 : 0;
      if (!in)
        missed += uri + " " + std::to_string(k) + ": " + std::to_string(truth) + " not in " +
                  std::to_string(value) + " +- " + std::to_string(width) + "\n";
    }
  }
  /// At the stated confidence, less three standard deviations of a binomial count.
  double least() const { return all * kErrorConfidence - 3 * std::sqrt(all * 0.95 * 0.05); }
};

constexpr const char* kScenes[] = {"plane", "vgroove-white", "vgroove-mixed", "vgroove-textured",
                                   "gummy", "occluder",      "mirror",        "views2",
                                   "views3"};

TEST(ErrorEstimate, the_truth_lies_within_the_stated_interval) {
  int narrow = 0, all = 0;
  for (const char* keys :
       {"?size=36x44&seed=907", "?size=36x44&seed=908&noise=off", "?size=29x31&seed=909&psf=0.08"}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + keys;
      coverage.add(uri, judge(uri));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << coverage.missed;
    narrow += coverage.narrow;
    all += coverage.all;
  }
  // With noise about as large as the errors on so few pixels, intervals of some errors reach down to 0: of
  // the third group, where light spreads, two of three do.
  EXPECT_GT(narrow, all / 3) << "intervals say something";
}

TEST(ErrorEstimate, of_a_search_that_a_budget_ended_too) {
  for (const std::int64_t most : {8, 24, 60}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + "?size=33x40&seed=911";
      coverage.add(uri, judge(uri, most));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << most << "\n" << coverage.missed;
  }
}

TEST(ErrorEstimate, of_indirect_light_is_within_its_interval_or_not_given_on_misaligned_rigs) {
  int given = 0, inside = 0;
  for (const char* scene : {"plane", "vgroove-textured", "gummy", "occluder"})
    for (const char* shift : {"0.1", "0.4", "1"}) {
      const std::string uri = std::string("sim:") + scene + "?size=28x32&seed=913&misalign=" + shift;
      const Judged judged = judge(uri, 0, true);
      const double value = judged.result.estimated->indirect;
      if (std::isnan(value)) {
        EXPECT_NE(judged.result.estimate_not_given[0].reason.find("one side"), std::string::npos) << uri;
        continue;
      }
      ++given;
      inside +=
          std::abs(value - judged.truth.indirect) <= judged.result.estimated_half_width.indirect ? 1 : 0;
    }
  EXPECT_LE(given - inside, 1) << "of " << given;
}

}  // namespace
}  // namespace symrig::error_interval_test
