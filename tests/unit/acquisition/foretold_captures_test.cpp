// SPDX-License-Identifier: Apache-2.0
// Captures on the rig's own clock, which is the same on every machine: what is told of the time to go holds.
#include "symrig/acquisition/capture.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::foretold_captures_test {
namespace {

struct Moment {
  double at;
  std::optional<double> left;
  std::string stage;
};

/// Every moment at which progress was told.
std::vector<Moment> captured(const std::string& uri, Algorithm algorithm) {
  auto rig = open_virtual_rig(uri);
  EXPECT_TRUE(rig.ok()) << uri;
  if (!rig) return {};
  CaptureOptions options;
  options.algorithm = algorithm;
  options.rule = default_rule(algorithm);
  options.economy = default_economy(algorithm);
  TimeToGo to_go;
  std::vector<Moment> moments;
  options.progress = [&](const ProgressEvent& event) {
    const double at = (*rig)->cost().rig_seconds;
    to_go.report(event, at);
    moments.push_back({at, to_go.seconds(), std::string(event.stage)});
    return true;
  };
  const auto result = capture(**rig, options);
  EXPECT_TRUE(result.ok()) << uri;
  moments.push_back({(*rig)->cost().rig_seconds, {}, "end"});
  return moments;
}

struct Case {
  const char* uri;
  Algorithm algorithm = Algorithm::symrig;
};

class Foretold : public ::testing::TestWithParam<Case> {};

TEST_P(Foretold, is_right_within_a_factor_of_two_after_a_tenth) {
  const std::vector<Moment> moments = captured(GetParam().uri, GetParam().algorithm);
  ASSERT_GT(moments.size(), 4U);
  const double end = moments.back().at;
  int told = 0;
  for (const Moment& moment : moments) {
    if (moment.at < 0.1 * end || !moment.left) continue;
    ++told;
    EXPECT_GE(*moment.left, 0.5 * (end - moment.at)) << moment.stage << " at " << moment.at << " of " << end;
    EXPECT_LE(*moment.left, 2.0 * (end - moment.at)) << moment.stage << " at " << moment.at << " of " << end;
  }
  EXPECT_GT(told, 0);
}

INSTANTIATE_TEST_SUITE_P(
    Captures, Foretold,
    ::testing::Values(Case{"sim:gummy?size=40x40&seed=5"}, Case{"sim:vgroove-textured?size=48x32&seed=6"},
                      Case{"sim:occluder?size=32x48&seed=7"}, Case{"sim:vgroove-mixed?size=50x39&noise=off"},
                      Case{"sim:mirror?size=32x32&seed=9"}, Case{"sim:views2?size=40x48&seed=4"},
                      Case{"sim:gummy?size=32x32&seed=8", Algorithm::paper},
                      Case{"sim:gummy?size=16x24&seed=8", Algorithm::brute}),
    [](const auto& one) { return "case_" + std::to_string(one.index); });

}  // namespace
}  // namespace symrig::foretold_captures_test
