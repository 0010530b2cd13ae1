// SPDX-License-Identifier: Apache-2.0
// What the library captures is what the command captures: defaults, checks and procedures are the library's.
#include "command.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>
#include <limits>

namespace symrig::test::library_test {
namespace {

using Words = std::vector<std::string>;

class Library : public CommandTest {
 protected:
  /// Writes command.h5 and command.json.
  void by_command(const std::string& rig, const Words& more) const {
    Words words{"capture", "--rig", rig, "-o", "command.h5", "--json", "command.json"};
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = symrig(words);
    ASSERT_EQ(outcome.code, 0) << rig << ": " << outcome.err;
  }
  /// Writes library.h5, without provenance.
  CaptureResult by_library(const std::string& rig, const CaptureOptions& options) const {
    auto opened = open_virtual_rig(rig);
    EXPECT_TRUE(opened.ok()) << rig;
    auto result = capture(**opened, options);
    EXPECT_TRUE(result.ok()) << rig << ": " << result.error().line();
    rig_seconds_ = (*opened)->cost().rig_seconds;
    frames_ = (*opened)->cost().frames;
    EXPECT_TRUE(save_scene(path("library.h5"), {result->tensor, "{}", result->held_out}).ok());
    return *std::move(result);
  }
  /// The command and the library, with the same choices.
  void compare(const std::string& rig, const Words& words, const CaptureOptions& options) const {
    std::string what = rig;
    for (const std::string& word : words) what += " " + word;
    SCOPED_TRACE(what);
    by_command(rig, words);
    const CaptureResult result = by_library(rig, options);
    expect_same_numbers(result);
    expect_same_scene();
  }

  /// The library refuses by itself, before it measures.
  static void expect_refused(const CaptureOptions& options, const std::string& begins) {
    auto rig = open_virtual_rig(std::string(kSmall) + "&exposures=4");
    ASSERT_TRUE(rig.ok());
    const auto result = capture(**rig, options);
    ASSERT_FALSE(result.ok()) << begins;
    EXPECT_EQ(result.error().code, ErrorCode::bad_argument) << begins;
    EXPECT_TRUE(result.error().what.starts_with(begins)) << result.error().line();
    EXPECT_EQ((*rig)->cost().photographs, 0) << begins;
  }

 private:
  void expect_same_numbers(const CaptureResult& result) const {
    const nlohmann::json told = json("command.json");
    EXPECT_EQ(told.at("patterns"), result.patterns);
    EXPECT_EQ(told.at("patterns_per_level"), nlohmann::json(result.patterns_per_level));
    EXPECT_EQ(told.at("stopped_by"), result.stopped_by);
    EXPECT_EQ(told.at("suspects"), result.suspects);
    EXPECT_EQ(told.at("frames"), frames_);
    // Baselines without a log ask for more photographs at once: gaps between runs are a few bytes' time.
    EXPECT_NEAR(told.at("rig_seconds").get<double>(), rig_seconds_, 1e-6 * rig_seconds_);
    EXPECT_EQ(told.at("error_per_level"), nlohmann::json(result.error_per_level));
    ASSERT_EQ(told.at("estimated_error").is_null(), !result.estimated);
    if (result.estimated) {
      EXPECT_EQ(told.at("estimated_error").at("frobenius"), result.estimated->frobenius);
    }
  }

  /// Everything that the two files hold but where they come from, bit by bit.
  void expect_same_scene() const {
    const auto command = load_scene(path("command.h5"));
    const auto library = load_scene(path("library.h5"));
    ASSERT_TRUE(command.ok() && library.ok());
    const TransportTensor& a = command->tensor;
    const TransportTensor& b = library->tensor;
    EXPECT_EQ(a.bytes(), b.bytes());
    EXPECT_EQ(a.symmetric(), b.symmetric());
    EXPECT_TRUE(std::ranges::equal(a.camera_tree().order(), b.camera_tree().order()));
    EXPECT_TRUE(std::ranges::equal(a.leaves(), b.leaves(), [](const Leaf& x, const Leaf& y) {
      return x.row_begin == y.row_begin && x.row_end == y.row_end && x.col_begin == y.col_begin &&
             x.col_end == y.col_end && x.rank == y.rank && x.level == y.level;
    }));
    EXPECT_EQ(*a.factors(), *b.factors());
    EXPECT_EQ(a.scalar_values(), b.scalar_values());
    EXPECT_TRUE(std::ranges::equal(a.scalars(), b.scalars(), [](const ScalarLeaf& x, const ScalarLeaf& y) {
      return x.row == y.row && x.col == y.col;
    }));
    EXPECT_TRUE(std::ranges::equal(a.bands(), b.bands(), [](const BandLeaf& x, const BandLeaf& y) {
      return x.radius == y.radius && x.values == y.values;
    }));
    EXPECT_TRUE(std::ranges::equal(a.column_rows(), b.column_rows()));
    EXPECT_TRUE(std::ranges::equal(a.column_values(), b.column_values()));
    for (int level = 0; level < a.levels(); ++level)
      EXPECT_EQ(a.empty_count(level), b.empty_count(level)) << level;
    EXPECT_TRUE(
        std::ranges::equal(command->held_out, library->held_out, [](const HeldOut& x, const HeldOut& y) {
          return x.name == y.name && x.pattern == y.pattern && x.photograph == y.photograph;
        }));
  }

  mutable double rig_seconds_ = 0;
  mutable std::int64_t frames_ = 0;
};

TEST_F(Library, captures_without_options_as_the_command_does) {
  for (const char* rig : {"sim:gummy?size=24x24", "sim:vgroove-textured?size=12x17&channels=3",
                          "sim:plane?size=16x16&noise=off&psf=0.1", "sim:views2?size=16x16",
                          "sim:occluder?size=16x16&exposures=auto"})
    compare(rig, {}, {});
}

TEST_F(Library, captures_with_every_algorithm_as_the_command_does) {
  for (const std::string_view text : algorithm_names())
    for (const char* rig : {"sim:gummy?size=16x16", "sim:vgroove-mixed?size=12x17&noise=off"})
      compare(rig, {"--algorithm", std::string(text)}, {.algorithm = *parse_algorithm(text)});
}

TEST_F(Library, understands_options_as_the_command_does) {
  const std::string rig = "sim:gummy?size=16x16", views = "sim:views2?size=16x16",
                    planned = "sim:gummy?size=12x12&exposures=auto";
  compare(rig, {"--tolerance", "3e-3"}, {.tolerance = 3e-3});
  compare(rig, {"--algorithm", "paper", "--tolerance", "3e-3", "--polish", "1"},
          {.algorithm = Algorithm::paper, .tolerance = 3e-3, .polish = 1});
  compare(rig, {"--algorithm", "dual", "--tolerance", "3e-3", "--dual-subtract"},
          {.algorithm = Algorithm::dual, .tolerance = 3e-3, .dual_subtracts = true});
  compare(rig, {"--algorithm", "dual", "--dual-threshold", "1e-2"},
          {.algorithm = Algorithm::dual, .dual_threshold = 1e-2});
  compare(rig, {"--max-patterns", "30"}, {.max_patterns = 30});
  compare(rig, {"--max-seconds", "2"}, {.max_seconds = 2});
  compare(rig, {"--target-error", "0.1"}, {.target_error = 0.1});
  compare(views, {"--split", "views-first"}, {.split = SplitOrder::views_first});
  compare(planned, {"--photograph-seconds", "1"}, {.photograph_seconds = 1});
}

// Both refuse, and the command says what the library says, in its own words.
TEST_F(Library, refuses_what_the_command_refuses) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  expect_refused({.tolerance = nan}, "tolerance");
  expect_refused({.tolerance = -1e-3}, "tolerance");
  expect_refused({.tolerance = 1}, "tolerance");
  expect_refused({.algorithm = Algorithm::dual, .dual_threshold = nan}, "dual_threshold");
  expect_refused({.polish = -1}, "polish");
  expect_refused({.polish = 21}, "polish");
  expect_refused({.photograph_seconds = nan}, "photograph_seconds");
  expect_refused({.photograph_seconds = -1}, "photograph_seconds");
  expect_refused({.photograph_seconds = 5}, "photograph_seconds");
  expect_refused({.split = SplitOrder::flat}, "split");
  expect_refused({.max_patterns = -5}, "max_patterns");
  expect_refused({.max_seconds = nan}, "max_seconds");
  expect_refused({.max_seconds = inf}, "max_seconds");
  expect_refused({.max_seconds = -1}, "max_seconds");
  expect_refused({.target_error = nan}, "target_error");
  expect_refused({.target_error = -0.1}, "target_error");
  expect_refused({.target_error = 1}, "target_error");
  expect_refused({.memory_limit = -1}, "memory_limit");
  expect_refused({.rule = RankRule{.signal_fraction = nan}}, "rule.signal_fraction");
  expect_refused({.rule = RankRule{.flood_fraction = -1}}, "rule.flood_fraction");
  expect_refused({.economy = Economy{.decay = nan}}, "economy.decay");
  expect_refused({.economy = Economy{.rank = 0}}, "economy.rank");
  expect_refused({.exposure = {.relative = nan}}, "exposure.relative");
  expect_refused({.algorithm = Algorithm::brute, .tolerance = 0.1}, "tolerance has no effect");
  expect_refused({.algorithm = Algorithm::brute, .max_patterns = 5}, "max_patterns has no effect");
  expect_refused({.algorithm = Algorithm::paper, .target_error = 0.1}, "target_error has no effect");
  expect_refused({.algorithm = Algorithm::paper, .dual_threshold = 0.1}, "dual_threshold has no effect");
  expect_refused({.algorithm = Algorithm::symrig, .dual_subtracts = true}, "dual_subtracts has no effect");
  expect_refusal({"capture", "--rig", kSmall, "-o", "a.h5", "--algorithm", "dual", "--tolerance", "0.01",
                  "--dual-threshold", "0.1"},
                 kUsage, {"--tolerance has no effect beside --dual-threshold"});
}

}  // namespace
}  // namespace symrig::test::library_test
