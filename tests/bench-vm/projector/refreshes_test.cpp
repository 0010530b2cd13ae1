// SPDX-License-Identifier: Apache-2.0
// Times of refreshes in a guest whose clock counts instructions (lane b), so nothing outside disturbs them.
#include "bench-vm/projector/expected_screens.hpp"

#include <chrono>
#include <thread>

namespace symrig::bench_vm::refreshes_test {
namespace {

/// The kernel rounds flip times down to whole microseconds. Its period and ours are in whole nanoseconds and
/// differ by at most one.
Nanoseconds tolerance(std::uint64_t refreshes) {
  return Nanoseconds(1'000 + static_cast<std::int64_t>(refreshes));
}

SteadyTime now() {
  return {std::chrono::duration_cast<Nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())};
}

class Refreshes : public ::testing::Test {
 protected:
  void open(const char* mode, int buffers, bool legacy) {
    DrmProjectorOptions options;
    options.connector = display_of("BENCH_VKMS").connector;
    options.mode = mode;
    options.buffers = buffers;
    options.legacy = legacy;
    projector = open_projector(options);
    ASSERT_TRUE(projector);
    ASSERT_TRUE(projector->counts_refreshes()) << projector->warnings().at(0);
    std::vector<Pattern> patterns;
    for (std::size_t k = 0; k < 4; ++k) patterns.push_back(pattern_number(k, projector->grid()));
    const auto loaded = projector->load(patterns);
    ASSERT_TRUE(loaded.ok()) << loaded.error().line();
  }

  Shown show(std::size_t k) {
    const auto shown = projector->show(k % 4);
    EXPECT_TRUE(shown.ok()) << shown.error().line();
    return shown ? *shown : Shown{};
  }

  void expect_consistent(const Shown& first, const Shown& shown) const {
    const std::uint64_t refreshes = shown.refresh - first.refresh;
    const Nanoseconds off =
        shown.since - first.since - static_cast<std::int64_t>(refreshes) * projector->refresh_period();
    EXPECT_LE(std::chrono::abs(off), tolerance(refreshes)) << "refresh " << refreshes;
  }

  std::unique_ptr<DrmProjector> projector;
};

TEST_F(Refreshes, each_pattern_gets_the_next_one) {
  for (const bool legacy : {false, true}) {
    ASSERT_NO_FATAL_FAILURE(open("640x480@60", legacy ? 2 : 3, legacy));
    const Shown first = show(0);
    for (std::uint64_t k = 1; k <= 300; ++k) {
      const Shown shown = show(k);
      ASSERT_EQ(shown.refresh, first.refresh + k);
      expect_consistent(first, shown);
      EXPECT_LE(shown.since, now()) << "it has begun";
      EXPECT_LT(now() - shown.since, projector->refresh_period() / 2) << "and is told in time";
    }
    projector.reset();
  }
}

TEST_F(Refreshes, those_that_were_missed_are_counted) {
  ASSERT_NO_FATAL_FAILURE(open("1024x768@60", 3, false));
  const Shown first = show(0);
  Shown before = first;
  for (std::int64_t k = 1; k <= 100; ++k) {
    // So late in the refresh, `skipped` more refreshes begin before the pattern is handed over.
    const std::int64_t skipped = k % 5;
    const Nanoseconds wait = skipped * projector->refresh_period() + Nanoseconds(2'000'000);
    std::this_thread::sleep_until(std::chrono::steady_clock::time_point(before.since.since + wait));
    const Shown shown = show(static_cast<std::size_t>(k));
    EXPECT_EQ(static_cast<std::int64_t>(shown.refresh - before.refresh), skipped + 1);
    expect_consistent(first, shown);
    before = shown;
  }
}

}  // namespace
}  // namespace symrig::bench_vm::refreshes_test
