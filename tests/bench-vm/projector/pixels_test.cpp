// SPDX-License-Identifier: Apache-2.0
// Compares the shown pixels with the requested ones. For vkms it reads the scanned-out memory, for QEMU's
// display the picture that QEMU sees.
#include "bench-vm/projector/expected_screens.hpp"
#include "symrig/base/files.hpp"

#include <chrono>
#include <cstdlib>
#include <functional>
#include <thread>

namespace symrig::bench_vm::pixels_test {
namespace {

using Look = std::function<Result<ScreenPixels>(const std::string& card)>;

/// The picture on QEMU's display.
Result<ScreenPixels> screendump(const std::string& /*card*/) {
  const char* out = std::getenv("BENCH_OUT");
  if (out == nullptr ||
      std::system("bench-screendump projector") != 0)  // NOLINT(concurrency-mt-unsafe,cert-env33-c)
    return Error{ErrorCode::io, "QEMU's display cannot be seen"};
  SYMRIG_TRY(const auto bytes, read_file(std::string(out) + "/projector.ppm"));
  return parse_ppm(bytes);
}

struct Case {
  const char* display;
  const char* mode;
  bool legacy;
  Placement placement;
};

std::ostream& operator<<(std::ostream& out, const Case& tested) {
  return out << tested.display << " " << tested.mode << (tested.legacy ? " legacy" : " atomic")
             << " cells of " << tested.placement.cell;
}

class Pixels : public ::testing::TestWithParam<Case> {
 protected:
  /// Shows pattern `number` in the middle of a sequence and compares all pixels.
  static void expect_shown(DrmProjector& projector, const std::string& card, std::size_t number,
                           const Look& look) {
    const Pattern pattern = pattern_number(number, projector.grid());
    const Pattern other(projector.grid(), 1, 0.5F);
    const Pattern sequence[] = {other, pattern, other};
    const auto loaded = projector.load(sequence);
    ASSERT_TRUE(loaded.ok()) << loaded.error().line();
    for (const std::size_t k : {0, 1}) {
      const auto shown = projector.show(k);
      ASSERT_TRUE(shown.ok()) << shown.error().line();
    }
    const auto seen = look(card);
    ASSERT_TRUE(seen.ok()) << seen.error().line();
    const auto wanted = expected_screen(pattern, GetParam().placement, projector.screen());
    EXPECT_EQ(differing_pixels(*seen, wanted), 0U) << "pattern " << number;
  }
};

TEST_P(Pixels, are_those_asked_for) {
  const Case& tested = GetParam();
  const bool vga = std::string(tested.display) == "BENCH_VGA";
  const GuestDisplay display = display_of(tested.display);
  DrmProjectorOptions options;
  options.connector = display.connector;
  options.mode = tested.mode;
  options.legacy = tested.legacy;
  options.placement = tested.placement;
  const auto projector = open_projector(options);
  ASSERT_TRUE(projector);
  EXPECT_EQ(projector->counts_refreshes(), !vga) << "QEMU's display has no refreshes";
  EXPECT_EQ(projector->warnings().size(), vga ? 1U : 0U);
  // Uses all patterns where they fill the smaller screen of vkms, and with SYMRIG_LONG=1 on every screen.
  // Otherwise uses every fifth one (structured, random, grey and binary) where only the display, the
  // placement or the size differs.
  const bool large = projector->screen().cols > 1'000;
  const bool all = std::getenv("SYMRIG_LONG") != nullptr || (tested.placement.cell == 1 && !large && !vga);
  const std::size_t step = all ? 1 : 5;
  for (std::size_t number = 0; number < kPatterns; number += step)
    expect_shown(*projector, display.card, number, vga ? Look(screendump) : Look(read_screen));
}

constexpr Placement kWhole;
constexpr Placement kPlaced{.cell = 7, .top = 33, .left = 50, .mirror_rows = true, .mirror_cols = true};

INSTANTIATE_TEST_SUITE_P(Vkms, Pixels,
                         ::testing::Values(Case{"BENCH_VKMS", "912x1140R@60", false, kWhole},
                                           Case{"BENCH_VKMS", "1920x1080@60", false, kWhole},
                                           Case{"BENCH_VKMS", "1920x1080@60", true, kPlaced},
                                           Case{"BENCH_VKMS", "912x1140R@60", false, kPlaced}));
INSTANTIATE_TEST_SUITE_P(Vga, Pixels,
                         ::testing::Values(Case{"BENCH_VGA", "912x1140", false, kWhole},
                                           Case{"BENCH_VGA", "1920x1080@60", false, kWhole},
                                           Case{"BENCH_VGA", "912x1140", true, kPlaced},
                                           Case{"BENCH_VGA", "1920x1080@60", false, kPlaced}));

// Times of refreshes in a guest whose clock counts instructions (lane b), so nothing outside disturbs them.

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
}  // namespace symrig::bench_vm::pixels_test
