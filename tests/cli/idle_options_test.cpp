// SPDX-License-Identifier: Apache-2.0
// Whoever gives an option expects something of it: one that changes nothing is refused.
#include "command.hpp"
#include "symrig/acquisition/algorithms.hpp"

namespace symrig::test::idle_options_test {
namespace {

using Words = std::vector<std::string>;

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

}  // namespace
}  // namespace symrig::test::idle_options_test
