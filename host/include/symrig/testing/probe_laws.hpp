// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <gtest/gtest.h>

/// The laws that every Probe keeps. Whoever writes one runs expect_probe_laws on it, in a GoogleTest program
/// that links symrig::symrig and GTest::gtest_main (docs/howto-own-rig.md):
///
///   TEST(RecordedProbe, keeps_the_laws) { expect_probe_laws(*open_capture("groove")); }
///
/// A law holds within the variance that the photographs themselves state, so that a probe which understates
/// its noise breaks one. No other header of symrig includes this one, and libsymrig does not need GoogleTest.
namespace symrig::probe_laws {

/// A residual Σ c_i x_i of photographs, whitened by its stated variance Σ c_i² Var[x_i].
struct Whitened {
  double mean_square = 0;  ///< of the residuals over their sigma; 1 if the variances are right
  double worst_exact = 0;  ///< largest residual where the variance is 0, relative to the largest mean
  double mean = 0;         ///< of the residuals over their sigma; 0 if unbiased
  std::int64_t count = 0;  ///< residuals with a variance
};

struct Term {
  double factor;
  const Radiance* photograph;
};

/// Over the values that all photographs hold valid.
inline Whitened whiten(std::span<const Term> terms) {
  Whitened out;
  double largest = 1e-30, sum_square = 0, sum = 0;
  const std::size_t n = terms[0].photograph->mean.values().size();
  for (std::size_t i = 0; i < n; ++i) {
    double residual = 0, variance = 0;
    bool valid = true;
    for (const Term& term : terms) {
      valid = valid && term.photograph->valid.values()[i] != 0;
      const double mean = term.photograph->mean.values()[i];
      residual += term.factor * mean;
      variance += term.factor * term.factor * term.photograph->variance.values()[i];
      largest = std::max(largest, std::abs(mean));
    }
    if (!valid) continue;
    if (variance <= 0) {
      out.worst_exact = std::max(out.worst_exact, std::abs(residual));
      continue;
    }
    sum_square += residual * residual / variance;
    sum += residual / std::sqrt(variance);
    ++out.count;
  }
  out.worst_exact /= largest;
  if (out.count == 0) return out;
  out.mean_square = sum_square / static_cast<double>(out.count);
  out.mean = sum / static_cast<double>(out.count);
  return out;
}

/// The mean square of n whitened residuals is 1 ± √(2/n); 5 of these sigmas and 4 % for the merge's own error
/// of variance are allowed above. Below it may fall to 0.7: photographs share the error of one black
/// photograph, which cancels in differences but counts in each variance. Noise-free residuals are float
/// rounding, 1e-5.
inline void expect_noise_only(const Whitened& residual, const char* law) {
  EXPECT_LE(residual.worst_exact, 1e-5) << law;
  if (residual.count == 0) return;
  const double spread = 5 * std::sqrt(2 / static_cast<double>(residual.count));
  EXPECT_LE(residual.mean_square, 1.04 + spread) << law << ", " << residual.count << " values";
  EXPECT_GE(residual.mean_square, 0.7 - spread) << law << ", " << residual.count << " values";
}

/// A random binary pattern: pixel lit with probability 1/2. Own generator: the same on every machine.
inline Pattern law_pattern(Grid grid, std::uint64_t seed) {
  Pattern pattern(grid);
  std::uint64_t state = 0x853c49e6748fea9bULL + seed;
  for (float& value : pattern.values()) {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    value = (state >> 40U) & 1U ? 1.F : 0.F;
  }
  return pattern;
}

inline Pattern complement(const Pattern& pattern) {
  Pattern other = pattern;
  for (float& value : other.values()) value = 1 - value;
  return other;
}

/// Measures, and fails the test if the probe does.
inline std::vector<Radiance> measured(Probe& probe, const std::vector<Pattern>& patterns) {
  auto photographs = probe.measure(patterns);
  if (!photographs.ok()) {
    ADD_FAILURE() << photographs.error().line();
    return {};
  }
  EXPECT_EQ(photographs->size(), patterns.size());
  return *std::move(photographs);
}

inline void expect_well_formed(const Probe& probe, const Radiance& r) {
  for (const Image<float>* image : {&r.mean, &r.variance}) {
    ASSERT_EQ(image->grid(), probe.camera_grid());
    ASSERT_EQ(image->channels(), probe.channels());
  }
  ASSERT_EQ(r.valid.grid(), probe.camera_grid());
  ASSERT_EQ(r.valid.channels(), probe.channels());
  for (std::size_t i = 0; i < r.mean.values().size(); ++i) {
    ASSERT_TRUE(std::isfinite(r.mean.values()[i])) << i;
    ASSERT_GE(r.variance.values()[i], 0.F) << i;
    if (r.valid.values()[i] != 0) continue;
    ASSERT_EQ(r.mean.values()[i], 0.F) << i;
    ASSERT_EQ(r.variance.values()[i], 0.F) << i;
  }
}

/// Light is not negative: nothing lies more than 6.5 sigmas below zero (1 in 2·10¹⁰ values), or 1e-6 of the
/// largest value where there is no noise.
inline void expect_non_negative(const Radiance& r) {
  float largest = 0;
  for (const float mean : r.mean.values()) largest = std::max(largest, mean);
  for (std::size_t i = 0; i < r.mean.values().size(); ++i)
    ASSERT_GE(r.mean.values()[i], -6.5F * std::sqrt(r.variance.values()[i]) - 1e-6F * largest) << i;
}

/// (bᵀ T a − aᵀ T b) / σ for disjoint a and b on valid pixels, one a channel; relative to bᵀ T a where there
/// is no noise. ta and tb: photographs of a and b.
inline std::vector<double> reciprocity(const Pattern& a, const Pattern& b, const Radiance& ta,
                                       const Radiance& tb) {
  std::vector<double> out;
  for (int c = 0; c < ta.mean.channels(); ++c) {
    double difference = 0, variance = 0, size = 1e-30;
    for (std::size_t i = 0; i < a.values().size(); ++i) {
      const double wa = a.values()[i], wb = b.values()[i];
      difference += wb * ta.mean.plane(c)[i] - wa * tb.mean.plane(c)[i];
      variance += wb * wb * ta.variance.plane(c)[i] + wa * wa * tb.variance.plane(c)[i];
      size += wb * ta.mean.plane(c)[i];
    }
    out.push_back(variance > 0 ? difference / std::sqrt(variance) : difference / size);
  }
  return out;
}

inline void expect_refusals(Probe& probe) {
  const auto before = probe.cost().photographs;
  const Grid grid = probe.grid();
  const auto refused = [&](const Pattern& bad, ErrorCode code, const char* why) {
    const std::vector<Pattern> patterns{Pattern(grid), bad};  // a good one first: nothing may be returned
    const auto result = probe.measure(patterns);
    ASSERT_FALSE(result.ok()) << why;
    EXPECT_EQ(result.error().code, code) << result.error().line();
  };
  refused(Pattern({grid.rows + 1, grid.cols}), ErrorCode::size_mismatch, "another grid");
  refused(Pattern(grid, 2), ErrorCode::size_mismatch, "coloured light");
  refused(Pattern(), ErrorCode::size_mismatch, "no pattern");
  for (const float value :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -0.001F, 1.001F}) {
    Pattern bad(grid);
    bad.values().back() = value;
    refused(bad, ErrorCode::bad_value, "a value outside [0, 1]");
  }
  EXPECT_EQ(probe.cost().photographs, before) << "a refused pattern was shown";
}

}  // namespace symrig::probe_laws

namespace symrig {

/// All laws. reciprocal: false for rigs whose optics are known not to be (flare, misalignment). A rig whose
/// camera has pixels of its own is not tested for reciprocity, because pixels and cells do not correspond.
inline void expect_probe_laws(Probe& probe, bool reciprocal = true) {
  using namespace probe_laws;  // NOLINT(google-build-using-namespace)
  ASSERT_TRUE(probe.grid().valid());
  ASSERT_GE(probe.channels(), 1);
  EXPECT_FALSE(probe.describe().empty());
  EXPECT_TRUE(measured(probe, {}).empty());

  const Grid grid = probe.grid();
  const Pattern a = law_pattern(grid, 1);
  const Pattern b = complement(a);
  Pattern dim = a;
  for (float& value : dim.values()) value *= 0.5F;
  const ProbeCost before = probe.cost();
  const auto p = measured(probe, {a, b, Pattern(grid, 1, 1.F), dim, a, Pattern(grid)});
  ASSERT_EQ(p.size(), 6U);
  const ProbeCost after = probe.cost();
  EXPECT_EQ(after.photographs - before.photographs, 6);
  EXPECT_GE(after.frames - before.frames, 6);
  EXPECT_GE(after.rig_seconds, before.rig_seconds);
  for (const Radiance& photograph : p) {
    expect_well_formed(probe, photograph);
    expect_non_negative(photograph);
  }

  const Radiance &ta = p[0], &tb = p[1], &flood = p[2], &half = p[3], &again = p[4], &black = p[5];
  const Term additive[] = {{1, &ta}, {1, &tb}, {-1, &flood}};
  const Term homogeneous[] = {{1, &ta}, {-2, &half}};
  const Term repeated[] = {{1, &ta}, {-1, &again}};
  const Term dark[] = {{1, &black}};
  expect_noise_only(whiten(additive), "T a + T b = T (a + b)");
  expect_noise_only(whiten(homogeneous), "T a = 2 T (a / 2)");
  expect_noise_only(whiten(repeated), "T a = T a");
  expect_noise_only(whiten(dark), "T 0 = 0");
  if (reciprocal && probe.grid() == probe.camera_grid()) {
    for (const double deviation : reciprocity(a, b, ta, tb))
      EXPECT_LE(std::abs(deviation), ta.variance.values()[0] > 0 ? 5 : 1e-5) << "b' T a = a' T b";
  }
  expect_refusals(probe);
}

}  // namespace symrig
