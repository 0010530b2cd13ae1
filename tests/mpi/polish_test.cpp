// SPDX-License-Identifier: Apache-2.0
// A scene that is polished by the ranks. command_test.py compares what different numbers of ranks write.
#include "polish.hpp"

#include "acquisition/errors/checks.hpp"
#include "acquisition/search/finishing.hpp"
#include "acquisition/tree/photographer.hpp"
#include "assert_ok.hpp"
#include "polish_parts.hpp"
#include "scratch.hpp"
#include "symrig/job/capture_job.hpp"
#include "unit/tensor/random_tensor.hpp"

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace symrig::polish_test {
namespace {

namespace fs = std::filesystem;
using mpi::PolishJob;
using mpi::PolishParts;
using mpi::Ranks;

/// All ranks' parts, one rank after the other.
TransportTensor dealt_and_joined(const TransportTensor& whole, int ranks, int count) {
  const PolishParts parts = *PolishParts::of(whole, ranks, count);
  PolishParts::Assembly assembly(parts, whole);
  std::size_t part = 0;
  for (int rank = 0; rank < ranks; ++rank) {
    EXPECT_LT(parts.of_rank(rank).begin, parts.of_rank(rank).end);
    const auto mine = parts.read(whole, rank);
    for (const auto& known : *mine) {
      EXPECT_EQ(parts.rank_of(part), rank);
      const std::vector<float> numbers = parts.numbers(known);
      EXPECT_EQ(numbers.size(), parts.number_count(whole, part));
      assembly.add(part++, numbers);
    }
  }
  EXPECT_EQ(part, parts.count());
  return std::move(assembly).finish();
}

TEST(PolishParts, joined_again_are_the_tensor_as_it_was) {
  for (const int channels : {1, 3})
    for (const int ranks : {1, 2, 5, 12, 14}) {
      const auto made =
          tests::RandomTensor(Grid{9, 7}, Grid{9, 7}, true, channels, 8).with_band(true).make(2, 3, 30);
      const TransportTensor& whole = made.tensor;
      const TransportTensor joined = dealt_and_joined(whole, ranks, std::max(ranks, 12));
      EXPECT_EQ(*joined.factors(), *whole.factors());
      EXPECT_EQ(joined.scalar_values(), whole.scalar_values());
      ASSERT_EQ(joined.bands().size(), 1U);
      EXPECT_EQ(joined.bands()[0].radius, whole.bands()[0].radius);
      EXPECT_EQ(joined.bands()[0].values, whole.bands()[0].values);
      for (int level = 0; level < whole.levels(); ++level)
        EXPECT_EQ(joined.empty_count(level), whole.empty_count(level));
      EXPECT_EQ(joined.bytes(), whole.bytes());
    }
}

TEST(PolishParts, hold_the_same_light_as_the_tensor) {
  const auto made =
      tests::RandomTensor(Grid{8, 9}, Grid{8, 9}, true, 2, 4, 0.0).with_band(true).make(2, 3, 30);
  const BlockTree& tree = made.tensor.camera_tree();
  const std::size_t pixels = tree.order().size();
  Image<float> light(Grid{8, 9});
  Random random(3);
  for (float& v : light.values()) v = static_cast<float>(random.uniform());
  const Image<float> seen = *made.tensor.apply(light);
  std::vector<acquisition::TreePhotograph> dark(1);
  dark[0].pattern.resize(pixels);
  tree.to_tree(light.plane(0), dark[0].pattern);
  dark[0].mean.resize(2 * pixels);
  const PolishParts parts = *PolishParts::of(made.tensor, 1, 12);
  const auto all = parts.read(made.tensor, 0);
  for (const auto& known : *all) known.subtract_from(dark);
  for (int channel = 0; channel < 2; ++channel)
    for (std::size_t t = 0; t < pixels; ++t) {
      const double whole = seen.plane(channel)[tree.order()[t]];
      // Numbers are not negative: pixels of the longest leaf, its three ranks of 24 leaves, entries, parts.
      EXPECT_NEAR(-dark[0].mean[static_cast<std::size_t>(channel) * pixels + t], whole,
                  2 * (72 + 3 * 24 + 38 + 12 + 4) * 0x1p-24 * whole);
    }
}

TEST(PolishParts, of_what_no_search_makes_are_refused) {
  const auto made = tests::RandomTensor(Grid{4, 4}, Grid{5, 3}, false, 1, 4).make(1, 1, 3);
  const auto parts = PolishParts::of(made.tensor, 2, 2);
  ASSERT_FALSE(parts);
  EXPECT_EQ(parts.error().code, ErrorCode::bad_value);
}

/// A capture that was not polished, and its log.
class PolishOfACapture : public testing::Test {
 protected:
  static constexpr const char* kRig = "sim:vgroove-textured?size=32x32";

  static Result<void> capture_to(const fs::path& scene, const std::string& rig) {
    SYMRIG_TRY(OpenedRig opened, open_rig(rig, "", {}));
    CaptureJob job{.output = scene.string(), .log = {.keep = true}, .options = {.polish = 0}};
    const Result<CaptureOutcome> outcome = run_job(job, opened);
    return outcome ? Result<void>() : Result<void>(outcome.error());
  }

  static void SetUpTestSuite() {
    scratch_ = new test::Scratch;
    ASSERT_OK(capture_to(*scratch_ / "scene.h5", kRig));
    ASSERT_OK(capture_to(*scratch_ / "other.h5", std::string(kRig) + "&seed=2"));
  }
  static void TearDownTestSuite() {
    delete scratch_;
    scratch_ = nullptr;
  }

  static PolishJob job(const char* scene = "scene.h5", const char* log = "scene.h5.log") {
    return {.scene = (*scratch_ / scene).string(), .log = (*scratch_ / log).string()};
  }

  static void expect_refused(const PolishJob& job, ErrorCode code, const std::string& text) {
    const auto polished = mpi::polish(Ranks::world(), job);
    ASSERT_FALSE(polished) << text;
    EXPECT_EQ(polished.error().code, code) << polished.error().line();
    EXPECT_NE(polished.error().line().find(text), std::string::npos) << polished.error().line();
  }

  static test::Scratch* scratch_;
};
test::Scratch* PolishOfACapture::scratch_ = nullptr;

TEST_F(PolishOfACapture, finds_the_photographs_that_were_held_out) {
  const StoredScene scene = *load_scene(job().scene);
  const auto found = mpi::open_photographs(job().log, scene, "scene.h5");
  ASSERT_OK(found);
  std::int64_t used = 0;
  for (const auto& range : found->used) used += range.last - range.first;
  EXPECT_EQ(used + std::ssize(scene.held_out), found->log->size());
  EXPECT_EQ(found->held_out.first, 1);
  ASSERT_LT(found->flood_lit.first, found->flood_lit.last) << "this rig is noisy: there are some at the end";
  for (std::int64_t k = found->flood_lit.first; k < found->flood_lit.last; ++k)
    EXPECT_EQ(*found->log->pattern(k), Pattern(Grid{32, 32}, 1, 1.F)) << k;
}

TEST_F(PolishOfACapture, lowers_the_misfit_and_states_the_errors) {
  const StoredScene before = *load_scene(job().scene);
  const auto polished = mpi::polish(Ranks::world(), job());
  ASSERT_OK(polished);
  EXPECT_LT(polished->after, polished->before);
  EXPECT_EQ(polished->scene.held_out.size(), before.held_out.size());
  EXPECT_EQ(polished->scene.tensor.leaves().size(), before.tensor.leaves().size());
  EXPECT_NE(*polished->scene.tensor.factors(), *before.tensor.factors());
  const auto facts = nlohmann::json::parse(polished->scene.capture_json);
  EXPECT_EQ(facts.at("estimated_error").at("frobenius"), polished->errors.value.frobenius);
  EXPECT_EQ(facts.at("polish").at("misfit").at("after"), polished->after);
  EXPECT_EQ(facts.at("patterns"), nlohmann::json::parse(before.capture_json).at("patterns"));
}

/// What is estimated from the log of a tensor that nothing has changed is what its capture has stated.
TEST_F(PolishOfACapture, estimates_errors_as_the_capture_does) {
  const StoredScene scene = *load_scene(job().scene);
  const auto found = *mpi::open_photographs(job().log, scene, "scene.h5");
  mpi::EndedRig rig(*found.log);
  const acquisition::Photographer photographer(rig, found.log.get(), scene.tensor.camera_tree(), {});
  const auto checks = acquisition::Checks::of_log(photographer, found.held_out, found.further);
  ASSERT_OK(checks);
  CaptureResult result;
  ASSERT_OK(
      acquisition::estimate_finished(scene.tensor, photographer, *checks, found.flood_lit, nullptr, result));
  const auto facts = nlohmann::json::parse(scene.capture_json);
  const auto& stated = facts.at("estimated_error");
  EXPECT_EQ(stated.at("frobenius"), result.estimated->frobenius);
  // This one applies T to random signs. A tensor from a file adds up its leaves in another order: pixels of
  // the longest leaf and leaves on a pixel's path, and signs cancel light.
  const double rounding = 2 * (32 * 32 + 200 + 4) * 0x1p-24;
  EXPECT_NEAR(stated.at("indirect"), result.estimated->indirect, rounding * result.estimated->indirect);
  EXPECT_EQ(stated.at("flood"), result.estimated->flood);
  const auto& half = facts.at("estimated_error_uncertainty");
  EXPECT_EQ(half.at("frobenius"), result.estimated_half_width.frobenius);
  EXPECT_NEAR(half.at("indirect"), result.estimated_half_width.indirect,
              2 * rounding * result.estimated_half_width.indirect);
  EXPECT_EQ(facts.at("noise_check").at("variance_ratio"), result.noise_check.variance_ratio);
  EXPECT_EQ(facts.at("noise_check").at("lamp"), result.noise_check.lamp);
}

TEST_F(PolishOfACapture, of_another_log_is_refused_and_the_ranks_go_on) {
  expect_refused(job("scene.h5", "other.h5.log"), ErrorCode::bad_value, "is not the log of");
  expect_refused(job("scene.h5", "none.log"), ErrorCode::not_found, "none.log");
  expect_refused(job("none.h5"), ErrorCode::not_found, "none.h5");
  expect_refused(job("scene.h5", "scene.h5"), ErrorCode::bad_format, "not a photograph log");
  expect_refused({.scene = job().scene, .log = job().log, .steps = 0}, ErrorCode::bad_argument, "steps");
  for (const int parts : {-1, Ranks::world().count() - 1, 1001})
    if (parts != 0)
      expect_refused({.scene = job().scene, .log = job().log, .parts = parts}, ErrorCode::bad_argument,
                     "parts");
  StoredScene without = *load_scene(job().scene);
  without.held_out.clear();
  ASSERT_OK(save_scene(*scratch_ / "without.h5", without));
  expect_refused(job("without.h5"), ErrorCode::bad_value, "no held-out photographs");
  StoredScene silent = *load_scene(job().scene);
  silent.capture_json = "{}";
  ASSERT_OK(save_scene(*scratch_ / "silent.h5", silent));
  expect_refused(job("silent.h5"), ErrorCode::bad_value, "does not state the tolerance");
  ASSERT_OK(mpi::polish(Ranks::world(), {.scene = job().scene, .log = job().log, .steps = 1}));
}

TEST_F(PolishOfACapture, of_a_log_that_a_capture_writes_is_refused) {
  const fs::path path = *scratch_ / "written.log";
  const auto writer = create_photograph_log(path, {Grid{32, 32}, 1, "a rig", ""});
  ASSERT_OK(writer);
  expect_refused(job("scene.h5", "written.log"), ErrorCode::io, "another process is writing");
}

TEST_F(PolishOfACapture, ends_when_it_is_interrupted) {
  int asked = 0;
  const auto polished = mpi::polish(Ranks::world(), job(), [&](const ProgressEvent&) { return ++asked < 5; });
  ASSERT_FALSE(polished);
  EXPECT_EQ(polished.error().code, ErrorCode::interrupted);
  EXPECT_EQ(asked, 5);
}

}  // namespace
}  // namespace symrig::polish_test
