// SPDX-License-Identifier: Apache-2.0
// Light that goes no farther than a few pixels, as captures meet it.
#include "dense_scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <cmath>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace symrig::short_range_test {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;

constexpr Grid kGrid{16, 16};
constexpr double kSigmas = 5;
constexpr std::int64_t kFlood = 1, kChecks = 6,
                       kDirect = 4;  // photographs; the last only where there is noise
constexpr std::int64_t kCombs = 25;

double albedo(int i) {
  return 0.4 + 0.6 * Random(static_cast<std::uint64_t>(i) + 3).uniform();
}

DenseTransport diagonal_scene() {
  return {kGrid, [](int i, int j) { return i == j ? albedo(i) : 0.0; }};
}

/// Each pixel lights those up to two away in rows and columns (5 × 5), by numbers that floats hold.
double band(int i, int j) {
  const int dy = std::abs(i / kGrid.cols - j / kGrid.cols), dx = std::abs(i % kGrid.cols - j % kGrid.cols);
  if (dy > 2 || dx > 2) return 0;
  if (i == j) return static_cast<double>(static_cast<float>(albedo(i)));
  const double textured = (0.5 + albedo(i)) * (0.5 + albedo(j)) * 0.02 / (dx * dx + dy * dy);
  return static_cast<double>(static_cast<float>(textured));
}
DenseTransport banded_scene() {
  return {kGrid, band};
}

struct Captured {
  CaptureResult result;
  /// T̃ as a dense matrix, column by column.
  std::vector<Image<float>> columns;
  double at(int i, int j) const { return static_cast<double>(columns[j].values()[i]); }
};

Captured captured(const DenseTransport& scene, double sigma) {
  DenseProbe probe(scene, sigma);
  auto result = capture(probe, tests::default_options());
  EXPECT_TRUE(result.ok());
  Captured all{std::move(*result), {}};
  for (std::size_t j = 0; j < static_cast<std::size_t>(scene.grid().size()); ++j) {
    Image<float> lit(scene.grid());
    lit.values()[j] = 1;
    all.columns.push_back(*all.result.tensor.apply(lit));
  }
  return all;
}

TEST(ShortRange, direct_light_with_noise_takes_no_level_at_all) {
  const DenseTransport scene = diagonal_scene();
  for (const double sigma : {1e-4, 1e-3, 1e-2}) {
    const Captured c = captured(scene, sigma);
    EXPECT_EQ(c.result.patterns, kFlood + kChecks + kDirect) << sigma;
    EXPECT_EQ(c.result.tensor.scalars().size(), 256U) << "the diagonal and nothing else";
    EXPECT_TRUE(c.result.tensor.leaves().empty());
    // Each entry was lit in all but the checks: 5 flood-lit photographs, so its variance is σ²/5. The misfit
    // that the model allows moves weights between equals only.
    double squares = 0;
    for (int i = 0; i < 256; ++i) squares += std::pow(c.at(i, i) - scene.at(i, i), 2);
    const double variance = sigma * sigma / (kFlood + kDirect);
    EXPECT_NEAR(squares / 256, variance, kSigmas * variance * std::sqrt(2.0 / 256)) << sigma;
  }
}

TEST(ShortRange, a_band_is_exact_after_its_combs) {
  const DenseTransport scene = banded_scene();
  const Captured c = captured(scene, 0);
  // The flood, the checks, the four blocks of the first level (only there do pairs of blocks tell how far the
  // light goes), the combs.
  EXPECT_EQ(c.result.patterns, kFlood + kChecks + 4 + kCombs);
  for (int j = 0; j < 256; ++j)
    for (int i = 0; i < 256; ++i) {
      // The diagonal is refitted to all photographs: their own rounding, 25 floats below 1 each summed in
      // float by the subtraction. The band is stored with 11 significant bits.
      const double rounding = i == j ? 32 * 0x1p-24 * 2 : 0x1p-11 * scene.at(i, j);
      ASSERT_NEAR(c.at(i, j), scene.at(i, j), rounding) << i << ' ' << j;
    }
}

TEST(ShortRange, noise_of_a_band_is_that_of_two_photographs) {
  const DenseTransport scene = banded_scene();
  constexpr double kSigma = 1e-4;
  const Captured c = captured(scene, kSigma);
  EXPECT_EQ(c.result.patterns, kFlood + kChecks + 4 + kCombs + kDirect);
  double squares = 0, pairs = 0, diagonal = 0;
  for (int j = 0; j < 256; ++j)
    for (int i = 0; i < 256; ++i) {
      const double e = c.at(i, j) - scene.at(i, j);
      if (i == j) diagonal += e * e;
      if (i < j && band(i, j) > 0) {
        squares += e * e;
        ++pairs;
      }
      if (band(i, j) <= 0) {
        ASSERT_EQ(c.at(i, j), 0) << i << ' ' << j;
      }
    }
  // An entry is the mean of two samples, i lit seen on j and j lit seen on i: variance σ²/2, and the mean
  // square of n such within √(2/n).
  const double variance = kSigma * kSigma / 2;
  EXPECT_NEAR(squares / pairs, variance, kSigmas * variance * std::sqrt(2 / pairs));
  // The diagonal begins with one sample and is refitted to more, in which the noise of the neighbours'
  // entries counts only above the tolerance τ_A F: no worse than one sample and that.
  double flood_squared = 0;
  const Image<float> flood = scene.apply(Image<float>(kGrid, 1, 1.0F));
  for (const float y : flood.values()) flood_squared += static_cast<double>(y) * static_cast<double>(y) / 256;
  const double tolerance = std::pow(default_rule(Algorithm::symrig).flood_fraction, 2) * flood_squared;
  EXPECT_LE(diagonal / 256, (kSigma * kSigma + tolerance) * (1 + kSigmas * std::sqrt(2.0 / 256)));
}

TEST(ShortRange, one_far_entry_is_not_settled_as_short_range) {
  constexpr int kFrom = 3 * 16 + 2, kTo = 12 * 16 + 14;
  for (const double far : {0.5, 0.05}) {
    const DenseTransport diagonal(kGrid, [=](int i, int j) {
      if (i == j) return albedo(i);
      return (i == kFrom && j == kTo) || (i == kTo && j == kFrom) ? far : 0.0;
    });
    const DenseTransport banded(kGrid, [=](int i, int j) {
      return (i == kFrom && j == kTo) || (i == kTo && j == kFrom) ? far : band(i, j);
    });
    for (const DenseTransport* scene : {&diagonal, &banded}) {
      const Captured c = captured(*scene, 0);
      EXPECT_NEAR(c.at(kFrom, kTo), far, 0.02 * far);  // τ_R of its own signal
      EXPECT_NEAR(c.at(kTo, kFrom), far, 0.02 * far);
    }
  }
}

TEST(ShortRange, a_narrower_band_takes_fewer_combs) {
  const DenseTransport scene(kGrid, [](int i, int j) {
    const int dy = std::abs(i / 16 - j / 16), dx = std::abs(i % 16 - j % 16);
    return dy <= 1 && dx <= 1 ? band(i, j) : 0.0;
  });
  EXPECT_EQ(captured(scene, 0).result.patterns, kFlood + kChecks + 4 + 9);
}

/// The little light that is unknown before the last levels is lost in noise, so it may seem to go two pixels
/// at most. Those levels take six photographs, and combs 25.
TEST(ShortRange, combs_are_not_taken_where_the_levels_cost_less) {
  for (int seed = 1; seed <= 60; ++seed) {
    auto rig = open_virtual_rig(
        "sim:vgroove-textured?size=20x16&exposures=2&ratio=4&light=0.5&profile=dlpc350&noise_seed=" +
        std::to_string(seed));
    ASSERT_TRUE(rig.ok());
    CaptureOptions options;
    options.tolerance = 0.01;
    int combs = 0;
    options.progress = [&combs](const ProgressEvent& event) {
      combs += event.stage == "short-range light" ? 1 : 0;
      return true;
    };
    const auto result = capture(**rig, options);
    ASSERT_TRUE(result.ok()) << result.error().line();
    EXPECT_EQ(combs, 0) << "seed " << seed << ": " << result->patterns << " photographs";
  }
}

}  // namespace
}  // namespace symrig::short_range_test
