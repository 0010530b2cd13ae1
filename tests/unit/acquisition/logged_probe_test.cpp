// SPDX-License-Identifier: Apache-2.0
#include "dense_scene.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <string_view>

#include <gtest/gtest.h>

namespace symrig {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;

/// Passes photographs on until it has given `limit`, then fails as a rig whose board was unplugged.
class FailingProbe final : public Probe {
 public:
  FailingProbe(Probe& inner, std::size_t limit) : inner_(inner), left_(limit) {}

  Grid grid() const override { return inner_.grid(); }
  int channels() const override { return inner_.channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return measure_expected(patterns, {});
  }
  bool plans_exposures(std::size_t photographs) const override { return inner_.plans_exposures(photographs); }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override {
    asked.push_back(patterns.size());
    if (patterns.size() > left_) return Error{ErrorCode::device_lost, "the board is gone", "plug it in"};
    left_ -= patterns.size();
    return inner_.measure_expected(patterns, expected);
  }
  ProbeCost cost() const override { return inner_.cost(); }
  Result<void> continue_after(const ProbeCost& spent) override {
    continued.push_back(spent);
    return inner_.continue_after(spent);
  }
  std::string describe() const override { return inner_.describe(); }

  std::vector<std::size_t> asked;
  std::vector<ProbeCost> continued;

 private:
  Probe& inner_;
  std::size_t left_;
};

constexpr std::size_t kNever = 1 << 30;

CaptureOptions default_options() {
  CaptureOptions options;
  options.economy = Economy{};  // every node is tested: more photographs
  return options;
}

/// The same bits, seen through random lights: factors that differ anywhere would show.
void expect_same(const TransportTensor& a, const TransportTensor& b) {
  EXPECT_EQ(a.bytes(), b.bytes());
  for (unsigned seed = 0; seed < 8; ++seed) {
    Pattern light(a.projector_grid());
    Random random(seed);
    for (float& v : light.values()) v = static_cast<float>(random.uniform());
    EXPECT_EQ(*a.apply(light), *b.apply(light)) << seed;
  }
}

/// refreshes: how many a session's waits for the projector may differ by. Where exposures are planned, a run
/// begins at the refresh that the one before it left.
void expect_same(const ProbeCost& a, const ProbeCost& b, double refreshes = 0) {
  EXPECT_EQ(a.photographs, b.photographs);
  EXPECT_EQ(a.frames, b.frames);
  // A projector's refresh is not a whole number of ticks: where a session begins may move a wait by a tick, 8
  // ns.
  EXPECT_NEAR(a.rig_seconds, b.rig_seconds, 8e-9 + 1e-12 * a.rig_seconds + refreshes / 60);
}

std::vector<Pattern> some_patterns(Grid grid, std::size_t count) {
  std::vector<Pattern> patterns;
  for (std::size_t k = 0; k < count; ++k) {
    patterns.emplace_back(grid);
    patterns.back().values()[k % patterns.back().values().size()] = 1;
  }
  return patterns;
}

TEST(LoggedProbe, logs_what_it_passes_on) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene, 0.01);
  DenseProbe twin(scene, 0.01);
  const auto log = make_memory_log(dense.grid(), 1);
  LoggedProbe probe(dense, *log);
  const auto patterns = some_patterns({6, 5}, 7);
  const auto answers = probe.measure(patterns);
  const auto expected = twin.measure(patterns);
  ASSERT_TRUE(answers.ok()) << answers.error().line();
  ASSERT_EQ(answers->size(), 7U);
  ASSERT_EQ(log->size(), 7);
  EXPECT_EQ(probe.replayed(), 0);
  expect_same(probe.cost(), dense.cost());
  for (std::size_t k = 0; k < 7; ++k) {
    EXPECT_EQ((*answers)[k].mean, (*expected)[k].mean);
    EXPECT_EQ(log->photograph(static_cast<std::int64_t>(k))->mean, (*expected)[k].mean);
    EXPECT_EQ(*log->pattern(static_cast<std::int64_t>(k)), patterns[k]);
    EXPECT_EQ(log->spent(static_cast<std::int64_t>(k))->photographs, static_cast<std::int64_t>(k) + 1);
  }
}

TEST(LoggedProbe, asks_for_no_more_at_once_than_may_be_lost) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene);
  FailingProbe failing(dense, 6);
  const auto log = make_memory_log(dense.grid(), 1);
  LoggedProbe probe(failing, *log, 3);
  const auto failed = probe.measure(some_patterns({6, 5}, 8));
  ASSERT_FALSE(failed.ok());
  EXPECT_EQ(failed.error().code, ErrorCode::device_lost);
  EXPECT_EQ(failing.asked, (std::vector<std::size_t>{3, 3, 2}));
  EXPECT_EQ(log->size(), 6);
}

TEST(LoggedProbe, refuses_a_log_of_other_patterns) {
  const DenseTransport scene = facing_planes({6, 5});
  DenseProbe dense(scene);
  const auto log = make_memory_log(dense.grid(), 1);
  const auto patterns = some_patterns({6, 5}, 4);
  ASSERT_TRUE(LoggedProbe(dense, *log).measure(patterns).ok());
  const std::vector<Pattern> others{patterns[0], patterns[2]};
  const auto refused = LoggedProbe(dense, *log).measure(others);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::bad_format);
  EXPECT_NE(refused.error().what.find("photograph 1"), std::string::npos) << refused.error().line();
  EXPECT_EQ(log->size(), 4);
}

TEST(LoggedProbe, tells_the_rig_once_what_was_spent_and_counts_on) {
  const DenseTransport scene = facing_planes({6, 5});
  const auto log = make_memory_log({6, 5}, 1);
  const auto patterns = some_patterns({6, 5}, 5);
  DenseProbe first(scene);
  ASSERT_TRUE(LoggedProbe(first, *log).measure(std::span(patterns).first(3)).ok());
  DenseProbe second(scene);
  ASSERT_TRUE(second.measure(std::span(patterns).first(2)).ok());  // a new session's metering
  FailingProbe rig(second, kNever);
  LoggedProbe probe(rig, *log);
  ASSERT_TRUE(probe.measure(std::span(patterns).first(2)).ok());
  EXPECT_EQ(probe.cost().photographs, 2);
  EXPECT_TRUE(rig.continued.empty());
  ASSERT_TRUE(probe.measure(std::span(patterns).subspan(2, 2)).ok());  // one from the log, one new
  ASSERT_TRUE(probe.measure(std::span(patterns).subspan(4)).ok());
  ASSERT_EQ(rig.continued.size(), 1U);
  EXPECT_EQ(rig.continued[0].photographs, 3);
  EXPECT_EQ(rig.asked, (std::vector<std::size_t>{1, 1}));
  EXPECT_EQ(probe.replayed(), 3);
  EXPECT_EQ(probe.cost().photographs, 5);
  EXPECT_EQ(log->size(), 5);
}

/// A rig that fails after some photographs, behind a log.
struct Session {
  Session(const char* uri, std::size_t together, std::size_t limit = kNever)
      : rig(*sim::open_virtual_rig(uri)),
        log(make_memory_log(rig->grid(), rig->channels())),
        failing(std::make_unique<FailingProbe>(*rig, limit)),
        probe(std::make_unique<LoggedProbe>(*failing, *log, together)) {}

  std::unique_ptr<sim::VirtualRig> rig;
  std::unique_ptr<PhotographLog> log;
  std::unique_ptr<FailingProbe> failing;
  std::unique_ptr<LoggedProbe> probe;
};

class BrokenOff : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Rigs, BrokenOff,
                         testing::Values("sim:vgroove-textured?size=13x17&noise=off",
                                         "sim:vgroove-textured?size=13x17&drift=0.5&dead=0.02",
                                         "sim:gummy?size=12x9&channels=3&exposures=3&flare=0.01",
                                         "sim:gummy?size=12x9&exposures=auto&drift=0.5"),
                         [](const auto& rig) { return "rig" + std::to_string(rig.index); });

// Noise and drift are those of the n-th photograph, whichever session takes it.
TEST_P(BrokenOff, anywhere_and_continued_a_capture_is_the_same) {
  const CaptureOptions options = default_options();
  for (const std::size_t together : {1U, 4U}) {
    const Session whole(GetParam(), together);
    const auto reference = capture(*whole.probe, options);
    ASSERT_TRUE(reference.ok()) << reference.error().line();
    const auto total = static_cast<std::size_t>(reference->patterns);
    ASSERT_GT(total, 20U);
    for (const std::size_t limit : {std::size_t{0}, std::size_t{1}, total / 3, total - 1}) {
      const Session first(GetParam(), together, limit);
      ASSERT_EQ(capture(*first.probe, options).error().code, ErrorCode::device_lost);
      ASSERT_LE(first.log->size(), static_cast<std::int64_t>(limit));
      ASSERT_GT(first.log->size() + static_cast<std::int64_t>(together), static_cast<std::int64_t>(limit));
      const auto rig = sim::open_virtual_rig(GetParam());
      LoggedProbe continued(**rig, *first.log, together);
      const auto result = capture(continued, options);
      ASSERT_TRUE(result.ok()) << result.error().line();
      EXPECT_EQ(result->patterns_per_level, reference->patterns_per_level);
      EXPECT_EQ(first.log->size(), reference->patterns);
      expect_same(result->tensor, reference->tensor);
      const bool planned = std::string_view(GetParam()).find("auto") != std::string_view::npos;
      expect_same(continued.cost(), whole.probe->cost(), planned ? 1 : 0);
    }
  }
}

}  // namespace
}  // namespace symrig
