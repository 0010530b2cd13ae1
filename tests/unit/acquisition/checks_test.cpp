// SPDX-License-Identifier: Apache-2.0
#include "acquisition/errors/checks.hpp"

#include "dense_scene.hpp"
#include "workbench.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::checks_test {
namespace {

using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;
using tests::Workbench;

constexpr Grid kGrid{16, 16};
constexpr std::size_t kPixels = 256;
constexpr double kEpsilon = 0x1p-24;
constexpr double kSigmas = 5;

/// All of a matrix, entry by entry; error(i, j) is added.
template <class Error>
void store(Workbench& bench, const DenseTransport& t, const Error& error) {
  const auto order = bench.tree.order();
  for (std::int32_t a = 0; a < std::ssize(order); ++a)
    for (std::int32_t b = 0; b <= a; ++b) {
      const int i = order[a];
      const int j = order[b];
      const auto value = static_cast<float>(t.at(i, j) + error(i, j));
      bench.known.add_scalar(a, b, std::span(&value, 1));
    }
}

double exactly(int /*i*/, int /*j*/) {
  return 0;
}

struct Shown {
  std::vector<Pattern> patterns;
  std::vector<Checks::Residual> residuals;
};

/// Takes the checks of a scene whose known transport is T + error.
template <class Error>
Shown check(const DenseTransport& scene, double sigma, const Error& error) {
  DenseProbe probe(scene, sigma);
  Shown shown;
  probe.watch = [&](const Pattern& p) { shown.patterns.push_back(p); };
  Workbench bench(probe);
  store(bench, scene, error);
  auto checks = Checks::take(bench.tree, bench.photographer);
  EXPECT_TRUE(checks.ok());
  shown.residuals = checks->residuals(bench.known);
  return shown;
}

double sum(const Pattern& p) {
  double total = 0;
  for (const float v : p.values()) total += static_cast<double>(v);
  return total;
}

TEST(Checks, halves_are_complements_and_sparse_patterns_are_disjoint) {
  for (const Grid grid : {Grid{16, 16}, Grid{32, 24}, Grid{5, 7}, Grid{1, 1}}) {
    const DenseTransport black(grid, [](int, int) { return 0.0; });
    const auto patterns = check(black, 0, exactly).patterns;
    ASSERT_EQ(patterns.size(), 6U);
    const auto n = static_cast<double>(grid.size());
    for (std::size_t i = 0; i < static_cast<std::size_t>(grid.size()); ++i) {
      EXPECT_EQ(patterns[0].values()[i] + patterns[1].values()[i], 1);
      EXPECT_EQ(patterns[2].values()[i] * patterns[3].values()[i], 0);
      for (const Pattern& p : patterns) EXPECT_TRUE(p.values()[i] == 0 || p.values()[i] == 1);
    }
    // Binomial: n q ± 5 √(n q (1 − q)), and one for the smallest grids.
    EXPECT_NEAR(sum(patterns[0]), n / 2, kSigmas * std::sqrt(n / 4) + 1);
    for (const std::size_t k : {2U, 3U})
      EXPECT_NEAR(sum(patterns[k]), n / 32, kSigmas * std::sqrt(n / 32) + 1);
  }
}

TEST(Checks, exact_transport_and_exact_photographs_leave_rounding) {
  const DenseTransport scene = facing_planes(kGrid);
  const auto errors = Checks::errors(check(scene, 0, exactly).residuals);
  // Each sample is a float sum of at most 256 entries ≥ 0, each rounded once: (n + 4) ε of itself, twice for
  // the difference of two; a random half of the light weighs at least a third of its signed sum here.
  const double bound = 6 * (kPixels + 4) * kEpsilon;
  for (const double e : {errors.frobenius, errors.flood, errors.indirect, errors.relight_bar,
                         errors.relight_random, errors.relight_natural, errors.bar_indirect})
    EXPECT_LE(e, bound);
}

double squares(const Image<float>& picture) {
  double total = 0;
  for (const float y : picture.values()) total += static_cast<double>(y) * static_cast<double>(y);
  return total;
}

/// Σ (T z)² for the signed sum z of check patterns a + sign b, over pixels.
double energy(const DenseTransport& t, const Pattern& a, const Pattern& b, float sign) {
  Pattern z = a;
  for (std::size_t i = 0; i < kPixels; ++i) z.values()[i] += sign * b.values()[i];
  return squares(t.apply(z));
}

TEST(Checks, exact_transport_is_estimated_at_what_the_noise_can_resolve) {
  const DenseTransport scene = facing_planes(kGrid);
  for (const double sigma : {1e-4, 1e-3, 1e-2}) {
    const Shown shown = check(scene, sigma, exactly);
    const TransportErrors errors = Checks::errors(shown.residuals);
    // Two photographs are added: n samples of variance V = 2σ². The squares of the residual less their noise
    // have mean 0 and deviation r = V √(2n), and are not let below r: so the estimate is √(r/S) .. √(5r/S).
    // S, the squares of the photograph less their noise, has deviation √(4 V S + 2 n V²).
    const double v = 2 * sigma * sigma;
    const double resolution = v * std::sqrt(2.0 * kPixels);
    const auto expect = [&](double estimate, double signal) {
      const double spread = kSigmas * std::sqrt(4 * v * signal + 2.0 * kPixels * v * v);
      EXPECT_GE(estimate, std::sqrt(resolution / (signal + spread)) * (1 - 1e-6)) << sigma;
      EXPECT_LE(estimate, std::sqrt(kSigmas * resolution / (signal - spread))) << sigma;
    };
    expect(errors.frobenius, energy(scene, shown.patterns[0], shown.patterns[1], -1));
    expect(errors.flood, energy(scene, shown.patterns[0], shown.patterns[1], 1));
  }
}

/// A symmetric error of random signs, `share` of each entry.
double wrong_by_signs(const DenseTransport& t, double share, int i, int j) {
  const auto seed =
      static_cast<std::uint64_t>(std::max(i, j)) * kPixels + static_cast<std::uint64_t>(std::min(i, j));
  return share * static_cast<double>(Random(seed).sign()) * t.at(i, j);
}

/// ‖M‖² and the deviation of ‖M z‖² over random signs z: 2 Σ_{j≠k} (M'M)_jk².
struct SignedProbe {
  double mean = 0, deviation = 0;
};
template <class Entry>
SignedProbe signed_probe(const Entry& entry) {
  SignedProbe result;
  double squares = 0;
  for (int j = 0; j < int{kPixels}; ++j)
    for (int k = 0; k <= j; ++k) {
      double product = 0;
      for (int i = 0; i < int{kPixels}; ++i) product += entry(i, j) * entry(i, k);
      if (j == k) result.mean += product;
      if (j != k) squares += 2 * product * product;
    }
  result.deviation = std::sqrt(2 * squares);
  return result;
}

TEST(Checks, the_frobenius_estimate_meets_the_error_of_a_wrong_tensor) {
  const DenseTransport scene = facing_planes(kGrid);
  constexpr double kShare = 0.05;
  const auto error = [&](int i, int j) { return wrong_by_signs(scene, kShare, i, j); };
  // The half less its complement is a vector of random signs: E ‖M z‖² = ‖M‖².
  const SignedProbe e = signed_probe(error);
  const SignedProbe t = signed_probe([&](int i, int j) { return scene.at(i, j); });
  ASSERT_LT(kSigmas * t.deviation, t.mean / 2);
  for (const double sigma : {0.0, 1e-4, 1e-3}) {
    const double estimate = Checks::errors(check(scene, sigma, error).residuals).frobenius;
    // Noise of V = 2σ² a sample adds √(4 V e + 2 n V²) to e, and as much to t in the same way.
    const double v = 2 * sigma * sigma;
    const auto spread = [&](const SignedProbe& of) {
      return kSigmas * (of.deviation + std::sqrt(4 * v * of.mean + 2.0 * kPixels * v * v));
    };
    EXPECT_GE(estimate * estimate, (e.mean - spread(e)) / (t.mean + spread(t))) << sigma;
    EXPECT_LE(estimate * estimate, (e.mean + spread(e)) / (t.mean - spread(t))) << sigma;
    EXPECT_GT(e.mean, spread(e)) << "the lower bound says something";
  }
}

TEST(Checks, flood_and_bar_estimates_are_those_of_the_evaluation) {
  // Both use the same patterns, so without noise they differ by rounding only; with noise of variance V a
  // sample by 5 √(4 V E + 2 n V²) in the squares E of the error, and at least its resolution V √(2n).
  const DenseTransport scene = facing_planes(kGrid);
  const auto error = [&](int i, int j) { return 0.03 * scene.at(i, j) * std::sin(i + j); };
  for (const double sigma : {0.0, 1e-4, 1e-3}) {
    DenseProbe probe(scene, sigma);
    Workbench bench(probe);
    store(bench, scene, error);
    auto checks = Checks::take(bench.tree, bench.photographer);
    const TransportErrors estimated = Checks::errors(checks->residuals(bench.known));
    const auto truth = evaluate(bench.known.tensor(), scene.truth());
    const auto expect = [&](double estimate, double actual, const Image<float>& lit, double v) {
      const double signal = squares(scene.apply(lit));
      const double wrong = actual * actual * signal;
      const double noise = kSigmas * std::sqrt(4 * v * wrong + 2.0 * kPixels * v * v);
      const double of_signal = kSigmas * std::sqrt(4 * v * signal + 2.0 * kPixels * v * v) / signal;
      const double rounding = 4 * (kPixels + 4) * kEpsilon * actual;
      EXPECT_NEAR(estimate * estimate, actual * actual,
                  (noise / signal + actual * actual * of_signal) / (1 - of_signal) + rounding)
          << sigma;
    };
    expect(estimated.flood, truth->flood, Image<float>(kGrid, 1, 1.0F), 2 * sigma * sigma);
    expect(estimated.relight_bar, truth->relight_bar, bar_pattern(kGrid), sigma * sigma);
  }
}

TEST(Checks, held_out_photographs_are_those_that_were_shown) {
  const DenseTransport scene = facing_planes(kGrid);
  DenseProbe probe(scene);
  std::vector<Pattern> shown;
  probe.watch = [&](const Pattern& p) { shown.push_back(p); };
  Workbench bench(probe);
  const auto checks = Checks::take(bench.tree, bench.photographer);
  const auto held = *checks->held_out(bench.tree, bench.photographer);
  ASSERT_EQ(held.size(), shown.size());
  for (std::size_t k = 0; k < shown.size(); ++k) {
    EXPECT_EQ(held[k].pattern, shown[k]);
    EXPECT_EQ(held[k].photograph, scene.apply(shown[k]));
  }
  EXPECT_EQ(checks->last() - checks->first(), 6);
}

TEST(Checks, the_misfit_of_half_counts_dark_pixels_only) {
  // Direct light alone is wrong: dark pixels of the halves see nothing of it.
  const DenseTransport scene = facing_planes(kGrid);
  const auto direct = [](int i, int j) { return i == j ? 0.5 : 0.0; };
  // Rounding: a float sum of up to 256 entries, of at most the largest row of indirect light (below 1).
  const double rounding = std::pow((kPixels + 4) * kEpsilon, 2);
  EXPECT_LE(Checks::misfit_of_half(check(scene, 0, direct).residuals)[0], rounding);
  // A constant error elsewhere: a dark pixel misses 1e-3 times the number of lit ones, 128 ± 5 · 8.
  const auto indirect = [](int i, int j) { return i != j ? 1e-3 : 0.0; };
  const double misfit = Checks::misfit_of_half(check(scene, 0, indirect).residuals)[0];
  EXPECT_GE(misfit, std::pow(1e-3 * (128 - 40), 2));
  EXPECT_LE(misfit, std::pow(1e-3 * (128 + 40), 2));
}

}  // namespace
}  // namespace symrig::acquisition::checks_test
