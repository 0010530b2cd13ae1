// SPDX-License-Identifier: Apache-2.0
// The fast parts of the decoder against slow ones that share nothing with them.
#include "calibration/footprint_shape.hpp"
#include "calibration/non_negative.hpp"
#include "calibration/small_median.hpp"
#include "calibration/stripe_kernels.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::calibration::decoder_parts_test {
namespace {

using test::normal;

constexpr std::size_t kSize = 6;
using Solver = NonNegative<kSize>;

struct Problem {
  Solver::Matrix a{};
  Solver::Vector b{};

  double value(const Solver::Vector& x) const {
    double sum = 0;
    for (std::size_t i = 0; i < kSize; ++i) {
      sum -= 2 * b[i] * x[i];
      for (std::size_t j = 0; j < kSize; ++j) sum += x[i] * a[i][j] * x[j];
    }
    return sum;
  }
};

/// A = Gᵀ G of nine random rows: positive definite.
Problem random_problem(std::uint64_t& counter) {
  Problem p;
  for (int row = 0; row < 9; ++row) {
    std::array<double, kSize> g{};
    for (double& v : g) v = normal(counter);
    const double y = normal(counter);
    for (std::size_t i = 0; i < kSize; ++i) {
      p.b[i] += g[i] * y;
      for (std::size_t j = 0; j < kSize; ++j) p.a[i][j] += g[i] * g[j];
    }
  }
  return p;
}

/// Gauss and Jordan, with the largest pivot, of the unknowns in `set`; the others are 0.
Solver::Vector slow_solution(const Problem& p, Solver::Set set) {
  std::array<std::array<double, kSize + 1>, kSize> rows{};
  for (std::size_t i = 0; i < kSize; ++i) {
    const bool in = (set >> i & 1U) != 0;
    for (std::size_t j = 0; j < kSize; ++j) rows[i][j] = in && (set >> j & 1U) ? p.a[i][j] : 0;
    if (!in) rows[i][i] = 1;
    rows[i][kSize] = in ? p.b[i] : 0;
  }
  for (std::size_t k = 0; k < kSize; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k; i < kSize; ++i)
      if (std::abs(rows[i][k]) > std::abs(rows[pivot][k])) pivot = i;
    std::swap(rows[k], rows[pivot]);
    for (std::size_t i = 0; i < kSize; ++i) {
      if (i == k) continue;
      const double factor = rows[i][k] / rows[k][k];
      for (std::size_t j = 0; j <= kSize; ++j) rows[i][j] -= factor * rows[k][j];
    }
  }
  Solver::Vector x{};
  for (std::size_t i = 0; i < kSize; ++i) x[i] = rows[i][kSize] / rows[i][i];
  return x;
}

/// The least value over all sets of unknowns that may be positive.
double slow_minimum(const Problem& p, Solver::Set free) {
  double least = 0;
  for (Solver::Set set = 1; set <= Solver::kAll; ++set) {
    const Solver::Vector x = slow_solution(p, set);
    bool allowed = true;
    for (std::size_t i = 0; i < kSize; ++i) allowed = allowed && (x[i] >= 0 || (free >> i & 1U) != 0);
    if (allowed) least = std::min(least, p.value(x));
  }
  return least;
}

// Both solve systems of six unknowns whose condition is below 1e6 or so: 1e-16 · 1e6, with room.
TEST(NonNegative, FindsTheMinimumOfAllSets) {
  std::uint64_t counter = 7;
  for (int i = 0; i < 200; ++i) {
    const Problem p = random_problem(counter);
    for (const Solver::Set free : {0U, 1U}) {
      const Solver solver(p.a, p.b, 0, free);
      const auto found = solver.minimum(Solver::kAll, {.active = free});
      const double least = slow_minimum(p, free);
      EXPECT_NEAR(p.value(found.x), least, 1e-8 * (1 + std::abs(least)));
      for (std::size_t k = free; k < kSize; ++k) EXPECT_GE(found.x[k], 0);
    }
  }
}

TEST(NonNegative, StartsAnywhereAndKeepsOutWhatIsNotAllowed) {
  std::uint64_t counter = 11;
  for (int i = 0; i < 50; ++i) {
    const Problem p = random_problem(counter);
    const Solver solver(p.a, p.b);
    constexpr Solver::Set kSome = 0b101101;
    const auto cold = solver.minimum(kSome, {});
    const auto warm = solver.minimum(kSome, solver.minimum(Solver::kAll, {}));
    for (std::size_t k = 0; k < kSize; ++k) {
      EXPECT_NEAR(cold.x[k], warm.x[k], 1e-8 * (1 + std::abs(cold.x[k])));
      if (!(kSome >> k & 1U)) {
        EXPECT_EQ(warm.x[k], 0);
      }
    }
  }
}

TEST(SmallMedian, IsTheMiddleOfTheSorted) {
  std::uint64_t counter = 3;
  for (std::size_t count = 1; count <= 28; ++count)
    for (const bool ties : {false, true}) {
      SmallMedian<28> median;
      std::vector<float> values;
      for (std::size_t i = 0; i < count; ++i) {
        const auto v = static_cast<float>(normal(counter));
        values.push_back(ties ? std::round(v) : v);
        median.add(values.back());
      }
      std::ranges::sort(values);
      EXPECT_EQ(median.value(), values[count / 2]) << count;
    }
}

// Sums of at most ten products in 32 bits, in any order: ten roundings of what the largest terms are.
TEST(StripeKernels, AreTheirEquations) {
  const StripeLight light(GrayCode({80, 100}), StripeAxis::columns);
  const Shape shape{0.1F, 0.4F, 0.1F, 0.05F, 0.1F, 0.1F, 0.05F};
  std::uint64_t counter = 5;
  Bits seen{};
  for (int k = 0; k < light.bits(); ++k) seen[k] = static_cast<float>(normal(counter));
  constexpr double kTolerance = 1e-5;
  for (const int pixel : {0, 37, 99})
    for (const std::optional<int> left_out : {std::optional<int>(), std::optional<int>(2)}) {
      ShapedPixel shaped;
      shape_pixel(light.at(pixel), light.bits(), shape, left_out, shaped);
      Steps explained;
      explain(seen, shaped, light.bits(), explained);
      for (std::size_t step = 0; step < kSteps; ++step) {
        double square = 0, along = 0;
        for (int bit = 0; bit < light.bits(); ++bit) {
          double m = 0;
          for (std::size_t s = 0; s < shape.size() && bit != left_out; ++s)
            m += static_cast<double>(shape[s]) *
                 static_cast<double>(light.at(pixel)[static_cast<std::size_t>(bit) * shape.size() + s][step]);
          EXPECT_NEAR(shaped.contrast[bit][step], m, kTolerance);
          square += m * m;
          along += m * static_cast<double>(seen[bit]);
        }
        EXPECT_NEAR(shaped.square[step], square, kTolerance);
        EXPECT_NEAR(explained[step], along > 0 ? along * along / square : 0, 10 * kTolerance);
      }
    }
}

/// Σ (D / contrast − Σ_s shape_s m(x; s))²
double misfit(const StripeLight& light, double x, const Bits& seen, float contrast, const Shape& shape) {
  double sum = 0;
  for (int bit = 0; bit < light.bits(); ++bit) {
    const Shape m = light.contrasts(x, bit);
    auto left = static_cast<double>(seen[bit] / contrast);
    for (std::size_t s = 0; s < m.size(); ++s) left -= static_cast<double>(shape[s] * m[s]);
    sum += left * left;
  }
  return sum;
}

TEST(ShapeFit, ExplainsWhatItWasGivenAndKeepsToAStrongPrior) {
  const StripeLight light(GrayCode({768, 1024}), StripeAxis::columns);
  const Shape truth{0, 0.5F, 0.1F, 0.05F, 0.1F, 0.1F, 0.05F}, usual{0, 0.4F, 0.2F, 0, 0.1F, 0.1F, 0.1F};
  constexpr float kContrast = 0.5F;
  ShapeFit fit;
  std::vector<Differences> pixels;
  const std::vector<double> positions{100.3, 333.6, 412.1};
  for (const double x : positions) {
    Differences seen{.value = {}, .variance = 1e-4F};
    for (int bit = 0; bit < light.bits(); ++bit) {
      const Shape m = light.contrasts(x, bit);
      for (std::size_t s = 0; s < m.size(); ++s) seen.value[bit] += kContrast * truth[s] * m[s];
    }
    fit.add(light, {}, x, seen, kContrast);
    pixels.push_back(seen);
  }
  const Shape found = fit.solve(usual, 1);
  double before = 0, after = 0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    before += misfit(light, positions[i], pixels[i].value, kContrast, usual);
    after += misfit(light, positions[i], pixels[i].value, kContrast, found);
  }
  EXPECT_LT(after, 0.1 * before);
  for (const float share : found) EXPECT_GE(share, 0);
  const Shape held = fit.solve(usual, 1e12);
  for (std::size_t s = 0; s < usual.size(); ++s) EXPECT_NEAR(held[s], usual[s], 1e-6);
}

}  // namespace
}  // namespace symrig::calibration::decoder_parts_test
