// SPDX-License-Identifier: Apache-2.0
// Captures that are broken off and continued from their log.
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/statistics.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::tests {

/// Passes photographs on until it has given `limit`, then fails as a rig whose board was unplugged.
class FailingProbe final : public Probe {
 public:
  FailingProbe(Probe& inner, std::size_t limit) : inner_(inner), left_(limit) {}

  Grid grid() const override { return inner_.grid(); }
  int channels() const override { return inner_.channels(); }
  ViewLayout views() const override { return inner_.views(); }
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

inline constexpr std::size_t kNever = 1 << 30;

inline CaptureOptions tested_options() {
  CaptureOptions options;
  options.economy = Economy{};  // every node is tested: more photographs
  return options;
}

/// The same bits, seen through random lights: factors that differ anywhere would show.
inline void expect_same(const TransportTensor& a, const TransportTensor& b) {
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
inline void expect_same(const ProbeCost& a, const ProbeCost& b, double refreshes = 0, double runs = 1) {
  EXPECT_EQ(a.photographs, b.photographs);
  EXPECT_EQ(a.frames, b.frames);
  // A projector's refresh is not a whole number of ticks: where a session begins may move a wait by a tick, 8
  // ns. With bit planes, each run begins with such a wait.
  EXPECT_NEAR(a.rig_seconds, b.rig_seconds, 8e-9 * runs + 1e-12 * a.rig_seconds + refreshes / 60);
}

/// A rig that fails after some photographs, behind a log.
struct Session {
  Session(const char* uri, std::size_t together, std::size_t limit = kNever)
      : rig(*open_virtual_rig(uri)),
        log(make_memory_log(rig->grid(), rig->channels())),
        failing(std::make_unique<FailingProbe>(*rig, limit)),
        probe(std::make_unique<LoggedProbe>(*failing, *log, together)) {}

  std::unique_ptr<VirtualRig> rig;
  std::unique_ptr<PhotographLog> log;
  std::unique_ptr<FailingProbe> failing;
  std::unique_ptr<LoggedProbe> probe;
};

/// A capture that is broken off after a few photographs, a third, or all but one, and then continued is the
/// same as a whole one. Noise and drift are those of the n-th photograph, whichever session takes it.
inline void expect_continued_is_the_same(const char* uri, const CaptureOptions& options = tested_options()) {
  for (const std::size_t together : {1U, 4U}) {
    const Session whole(uri, together);
    const auto reference = capture(*whole.probe, options);
    ASSERT_TRUE(reference.ok()) << reference.error().line();
    const std::size_t total = reference->patterns;
    ASSERT_GT(total, 20U);
    for (const std::size_t limit : {std::size_t{0}, std::size_t{1}, total / 3, total - 1}) {
      const Session first(uri, together, limit);
      ASSERT_EQ(capture(*first.probe, options).error().code, ErrorCode::device_lost);
      ASSERT_LE(first.log->size(), static_cast<std::int64_t>(limit));
      ASSERT_GT(first.log->size() + static_cast<std::int64_t>(together), static_cast<std::int64_t>(limit));
      const auto rig = open_virtual_rig(uri);
      LoggedProbe continued(**rig, *first.log, together);
      const auto result = capture(continued, options);
      ASSERT_TRUE(result.ok()) << result.error().line();
      EXPECT_EQ(result->patterns_per_level, reference->patterns_per_level);
      // After a search that has found nothing to rely on, the rig is asked once more.
      EXPECT_EQ(first.log->size(), reference->patterns + (reference->undetermined ? 5 : 0));
      expect_same(result->tensor, reference->tensor);
      const bool planned = std::string_view(uri).find("auto") != std::string_view::npos;
      const bool planes = std::string_view(uri).find("dlpc350") != std::string_view::npos;
      expect_same(continued.cost(), whole.probe->cost(), planned ? 1 : 0,
                  planes ? static_cast<double>(total) : 1);
    }
  }
}

}  // namespace symrig::tests
