// SPDX-License-Identifier: Apache-2.0
// Photographs in batches: one is taken while the one before is used.
#include "acquisition/tree/photographer.hpp"

#include "dense_scene.hpp"
#include "symrig/acquisition/photograph_log.hpp"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <functional>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::photographer_test {
namespace {

using acquisition::LitBlocks;
using acquisition::Photographer;
using acquisition::TreePhotograph;
using tests::DenseProbe;
using tests::facing_planes;

constexpr Grid kGrid{6, 5};
constexpr std::size_t kPatterns = 70;  // three batches of at most 32

/// Tells of each call, and may answer otherwise.
class WatchedProbe final : public Probe {
 public:
  explicit WatchedProbe(std::size_t together) : together_(together) {}
  Grid grid() const override { return dense_.grid(); }
  int channels() const override { return 1; }
  std::size_t together() const override { return together_; }
  ProbeCost cost() const override { return dense_.cost(); }
  std::string describe() const override { return "watched"; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    threads.push_back(std::this_thread::get_id());
    if (before) before();
    SYMRIG_TRY(std::vector<Radiance> answers, dense_.measure(patterns));
    answered += answers.size();
    if (spoil) spoil(answers);
    if (fails_after > 0 && answered > fails_after) return Error{ErrorCode::device_lost, "gone", ""};
    return answers;
  }

  std::function<void()> before;
  std::function<void(std::vector<Radiance>&)> spoil;
  std::vector<std::thread::id> threads;
  std::size_t answered = 0, fails_after = 0;

 private:
  std::size_t together_;
  tests::DenseTransport scene_ = facing_planes(kGrid);
  DenseProbe dense_{scene_, 0.01};
};

/// One pixel each.
std::vector<LitBlocks> pixels() {
  std::vector<LitBlocks> patterns;
  for (std::size_t k = 0; k < kPatterns; ++k) {
    const auto t = static_cast<std::int32_t>(k % static_cast<std::size_t>(kGrid.size()));
    patterns.push_back({{t, t + 1}});
  }
  return patterns;
}

/// What was handed on, one photograph after another.
struct Used {
  std::vector<std::int64_t> numbers;
  std::vector<PagedVector<float>> means, patterns;

  void add(std::int64_t first, std::span<TreePhotograph> photographs) {
    for (const TreePhotograph& one : photographs) {
      numbers.push_back(first++);
      means.push_back(one.mean);
      patterns.push_back(one.pattern);
    }
  }
};

Used take(Probe& probe) {
  const BlockTree tree(probe.grid());
  Photographer photographer(probe, nullptr, tree, {});
  Used used;
  const auto taken = photographer.take(
      "all", pixels(), [&](std::int64_t first, std::span<TreePhotograph> some) { used.add(first, some); });
  EXPECT_TRUE(taken.ok()) << taken.error().line();
  EXPECT_EQ(photographer.taken(), std::int64_t{kPatterns});
  return used;
}

/// The rig would wait for ever if the host did not use one batch beside the next.
TEST(Photographer, uses_a_batch_while_the_next_is_photographed) {
  WatchedProbe probe(1);
  const BlockTree tree(probe.grid());
  Photographer photographer(probe, nullptr, tree, {});
  std::mutex mutex;
  std::condition_variable changed;
  std::size_t used = 0;
  bool waited_in_vain = false;
  probe.before = [&] {
    if (probe.threads.size() < 2) return;  // nothing is there to be used yet
    std::unique_lock lock(mutex);
    const std::size_t wanted = 32 * (probe.threads.size() - 1);
    waited_in_vain |= !changed.wait_for(lock, std::chrono::seconds(60), [&] { return used >= wanted; });
  };
  const auto taken =
      photographer.take("all", pixels(), [&](std::int64_t /*first*/, std::span<TreePhotograph> some) {
        const std::lock_guard lock(mutex);
        used += some.size();
        changed.notify_all();
      });
  ASSERT_TRUE(taken.ok()) << taken.error().line();
  EXPECT_FALSE(waited_in_vain);
  EXPECT_EQ(probe.threads.size(), 3U);
}

TEST(Photographer, asks_the_rig_in_the_thread_that_captures) {
  WatchedProbe probe(1);
  take(probe);
  for (const std::thread::id thread : probe.threads) EXPECT_EQ(thread, std::this_thread::get_id());
}

TEST(Photographer, hands_on_the_same_whether_or_not_the_host_works_beside_the_rig) {
  WatchedProbe beside(1), alone(4);
  const Used one = take(beside), other = take(alone);
  ASSERT_EQ(one.numbers.size(), kPatterns);
  for (std::size_t k = 0; k < kPatterns; ++k) EXPECT_EQ(one.numbers[k], static_cast<std::int64_t>(k));
  EXPECT_EQ(one.numbers, other.numbers);
  EXPECT_EQ(one.means, other.means);
  EXPECT_EQ(one.patterns, other.patterns);
}

TEST(Photographer, a_rig_that_fails_ends_it_with_the_batches_before_used) {
  WatchedProbe probe(1);
  probe.fails_after = 64;
  const BlockTree tree(probe.grid());
  Photographer photographer(probe, nullptr, tree, {});
  Used used;
  const auto taken = photographer.take(
      "all", pixels(), [&](std::int64_t first, std::span<TreePhotograph> some) { used.add(first, some); });
  ASSERT_FALSE(taken.ok());
  EXPECT_EQ(taken.error().code, ErrorCode::device_lost);
  EXPECT_EQ(photographer.taken(), 64);
  for (std::size_t k = 0; k < used.numbers.size(); ++k)
    EXPECT_EQ(used.numbers[k], static_cast<std::int64_t>(k));
  EXPECT_LE(used.numbers.size(), 64U);
}

TEST(Photographer, refuses_what_is_no_number_in_whichever_batch_it_is) {
  for (const std::size_t together : {1U, 4U})
    for (const std::size_t bad : {5U, 40U, 69U}) {
      WatchedProbe probe(together);
      probe.spoil = [&](std::vector<Radiance>& answers) {
        const std::size_t first = probe.answered - answers.size();
        if (bad >= first && bad < probe.answered)
          answers[bad - first].mean.values()[3] = std::numeric_limits<float>::quiet_NaN();
      };
      const BlockTree tree(probe.grid());
      Photographer photographer(probe, nullptr, tree, {});
      Used used;
      const auto taken = photographer.take(
          "all", pixels(),
          [&](std::int64_t first, std::span<TreePhotograph> some) { used.add(first, some); });
      ASSERT_FALSE(taken.ok()) << together << " " << bad;
      EXPECT_EQ(taken.error().code, ErrorCode::bad_value);
      EXPECT_LE(used.numbers.size(), bad);
    }
}

TEST(Photographer, a_user_who_stops_it_gets_no_further_batch) {
  WatchedProbe probe(1);
  const BlockTree tree(probe.grid());
  int events = 0;
  Photographer photographer(probe, nullptr, tree, Work([&](const ProgressEvent&) { return ++events < 2; }));
  Used used;
  const auto taken = photographer.take(
      "all", pixels(), [&](std::int64_t first, std::span<TreePhotograph> some) { used.add(first, some); });
  ASSERT_FALSE(taken.ok());
  EXPECT_EQ(taken.error().code, ErrorCode::interrupted);
  EXPECT_EQ(probe.threads.size(), 1U);
}

/// Photographs of 1.4 million pixels, of one grey level each.
class LargeProbe final : public Probe {
 public:
  Grid grid() const override { return {1000, 1400}; }
  int channels() const override { return 1; }
  ProbeCost cost() const override { return {}; }
  std::string describe() const override { return "large"; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    std::vector<Radiance> answers;
    for (std::size_t k = 0; k < patterns.size(); ++k)
      answers.push_back({Image<float>(grid(), 1, static_cast<float>(++taken_)), Image<float>(grid(), 1, 1),
                         Image<std::uint8_t>(grid(), 1, 1)});
    return answers;
  }

 private:
  int taken_ = 0;
};

// Sixteen of them would be 291 MB. So few are handed on at a time, each once and in their order.
TEST(Photographer, hands_on_few_large_photographs_at_a_time) {
  LargeProbe probe;
  const BlockTree tree(probe.grid());
  Photographer photographer(probe, nullptr, tree, {});
  EXPECT_TRUE(photographer.hands_on_few());
  const std::vector<LitBlocks> patterns(20, LitBlocks{{0, 1}});
  std::vector<float> seen;
  std::size_t most = 0;
  ASSERT_TRUE(photographer.take("large", patterns, [&](std::int64_t first, std::span<TreePhotograph> some) {
    EXPECT_EQ(first, std::ssize(seen));
    for (const TreePhotograph& one : some) seen.push_back(one.mean[1'000'000]);
    most = std::max(most, some.size());
  }));
  EXPECT_EQ(most, 4U);
  for (std::size_t k = 0; k < patterns.size(); ++k) EXPECT_EQ(seen.at(k), static_cast<float>(k + 1));

  WatchedProbe small(1);
  const BlockTree of_small(small.grid());
  EXPECT_FALSE(Photographer(small, nullptr, of_small, {}).hands_on_few());
}

TEST(Photographer, reads_few_large_photographs_at_a_time_unless_more_are_asked_for) {
  LargeProbe probe;
  const BlockTree tree(probe.grid());
  const auto log = make_memory_log(probe.grid(), probe.channels());
  constexpr std::int64_t kTaken = 9;
  const Pattern dark(probe.grid());
  for (std::int64_t k = 0; k < kTaken; ++k)
    ASSERT_TRUE(log->append(dark, probe.measure({&dark, 1})->front(), {}));
  Photographer photographer(probe, log.get(), tree, {});
  const auto sizes = [&](std::size_t fewest) {
    std::vector<std::size_t> handed_on;
    float next = 1;
    const auto use = [&](std::int64_t first, std::span<TreePhotograph> some) {
      EXPECT_EQ(first, static_cast<std::int64_t>(next) - 1);
      for (const TreePhotograph& one : some) EXPECT_EQ(one.mean[1'000'000], next++);
      handed_on.push_back(some.size());
    };
    EXPECT_TRUE(photographer.read(0, kTaken, use, fewest));
    return handed_on;
  };
  EXPECT_EQ(sizes(1), (std::vector<std::size_t>{4, 4, 1}));
  EXPECT_EQ(sizes(6), (std::vector<std::size_t>{6, 3}));
  EXPECT_EQ(sizes(16), (std::vector<std::size_t>{9}));
}

}  // namespace
}  // namespace symrig::photographer_test
