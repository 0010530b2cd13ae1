// SPDX-License-Identifier: Apache-2.0
// The fast parts of the decoder against slow ones that share nothing with them.
#include "calibration/fitting/least_squares.hpp"
#include "calibration/pixel_map/raw_map.hpp"
#include "calibration/pixel_map/stripe_light.hpp"
#include "calibration/pixel_map/stripe_search.hpp"
#include "symrig/base/statistics.hpp"
#include "synthetic_photographs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
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

/// Median change of the decoded pairs in the 7 × 7 pixels around, for each camera pixel.
double slow_slope(const RawMap& map, std::size_t axis, int row, int col, int rows, int cols) {
  const auto decoded = [&](int r, int c) {
    return std::abs(r - row) <= kSupportReach && std::abs(c - col) <= kSupportReach && r >= 0 && c >= 0 &&
           r < map.grid().rows && c < map.grid().cols && map.mask.at(r, c) != 0;
  };
  std::vector<double> changes;
  for (int r = row - kSupportReach; r <= row + kSupportReach; ++r)
    for (int c = col - kSupportReach; c <= col + kSupportReach; ++c)
      if (decoded(r, c) && decoded(r + rows, c + cols))
        changes.push_back(static_cast<double>(map.position[axis].at(r + rows, c + cols)) -
                          static_cast<double>(map.position[axis].at(r, c)));
  return median(changes) / kSlopeApart;
}

bool slowly_supported(const RawMap& map, int row, int col, const DecodePolicy& policy) {
  int decoded = 0, agreeing = 0;
  for (int r = std::max(row - kSupportReach, 0); r <= std::min(row + kSupportReach, map.grid().rows - 1); ++r)
    for (int c = std::max(col - kSupportReach, 0); c <= std::min(col + kSupportReach, map.grid().cols - 1);
         ++c) {
      if ((r == row && c == col) || !map.mask.at(r, c)) continue;
      double square = 0;
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const double off = static_cast<double>(map.position[axis].at(r, c)) -
                           static_cast<double>(map.position[axis].at(row, col)) -
                           slow_slope(map, axis, row, col, kSlopeApart, 0) * (r - row) -
                           slow_slope(map, axis, row, col, 0, kSlopeApart) * (c - col);
        square += off * off;
      }
      ++decoded;
      agreeing += square <= policy.support_distance * policy.support_distance ? 1 : 0;
    }
  return agreeing >= 6 && agreeing >= policy.support_share * decoded;
}

// Rows of one pixel, of one more than a vector of any instruction set, and of several vectors; from few
// decoded pixels to all. Positions are random multiples of 2⁻⁷, so both sides compute the same slopes, except
// for a third of a sum that floats round; no distance is that close to the limit.
TEST(DropUnsupported, AsksTheNeighboursOfEachPixel) {
  std::uint64_t counter = 3;
  const DecodePolicy policy;
  for (const Grid grid : {Grid{1, 1}, Grid{5, 17}, Grid{20, 53}})
    for (const double share : {0.2, 0.6, 1.0}) {
      RawMap map{{Image<float>(grid), Image<float>(grid)}, Image<std::uint8_t>(grid)};
      for (int row = 0; row < grid.rows; ++row)
        for (int col = 0; col < grid.cols; ++col) {
          const double off = normal(counter) > 1 ? 3 : 0.3;
          map.mask.at(row, col) = std::abs(normal(counter)) < 3 * share - 0.4 ? 1 : 0;
          const double at[] = {0.9 * col + 0.1 * row + off * normal(counter),
                               0.8 * row - 0.1 * col + off * normal(counter)};
          for (std::size_t axis = 0; axis < 2; ++axis)
            map.position[axis].at(row, col) = static_cast<float>(std::round(128 * at[axis]) / 128);
        }
      RawMap found = map;
      drop_unsupported(found, policy);
      for (int row = 0; row < grid.rows; ++row)
        for (int col = 0; col < grid.cols; ++col)
          EXPECT_EQ(found.mask.at(row, col) != 0,
                    map.mask.at(row, col) && slowly_supported(map, row, col, policy))
              << grid.cols << " " << share << " " << row << " " << col;
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
  std::array<ScaleLanes, kMaxBits> m;
  light.contrasts(x, m.data());
  for (int bit = 0; bit < light.bits(); ++bit) {
    auto left = static_cast<double>(seen[bit] / contrast);
    for (std::size_t s = 0; s < shape.size(); ++s) left -= static_cast<double>(shape[s] * m[bit][s]);
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
    std::array<ScaleLanes, kMaxBits> m;
    light.contrasts(x, m.data());
    for (int bit = 0; bit < light.bits(); ++bit)
      for (std::size_t s = 0; s < truth.size(); ++s) seen.value[bit] += kContrast * truth[s] * m[bit][s];
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

/// Columns of a surface that bends, with an error for each pixel, and a stated deviation that is ten times
/// too small.
struct Positions {
  static constexpr Grid kGrid{480, 480};
  static constexpr float kStated = 0.01F;
  RawMap map{{Image<float>(kGrid), Image<float>(kGrid)}, Image<std::uint8_t>(kGrid, 1, 1)};
  Image<float> sigma{kGrid, 1, kStated};
  std::vector<double> errors;

  template <class Error>
  explicit Positions(Error error) {
    for (int r = 0; r < kGrid.rows; ++r)
      for (int c = 0; c < kGrid.cols; ++c) {
        errors.push_back(error(r, c));
        map.position[0].at(r, c) =
            static_cast<float>(200 + 0.8 * c + 0.1 * r + 0.002 * c * c - 0.001 * r * r + errors.back());
      }
  }
  void scale() { scale_to_scatter(sigma, map, StripeAxis::columns, Image<float>(kGrid, 1, 10.0F)); }
  /// Stated deviation after scaling over the errors' own.
  double ratio() {
    scale();
    return static_cast<double>(sigma.at(60, 80)) / robust_sigma(errors, 0);
  }
};

TEST(ScaleToScatter, FindsNoise) {
  std::uint64_t counter = 1;
  // 14,000 windows a group: a robust sigma scatters by 1.17 / √28000 = 0.7 %, with windows that overlap by up
  // to twice as much. The larger one of two directions is 0.6 of that above 1 in the mean.
  EXPECT_NEAR(Positions([&](int, int) { return 0.1 * normal(counter); }).ratio(), 1.008, 5 * 0.014);
}

TEST(ScaleToScatter, FindsErrorsThatRepeatAlongRowsOrColumns) {
  // The third difference of a wave of period P, `apart` pixels apart, is a wave (2 sin(π apart / P))³ as
  // high. Independent errors have √20. The direction in which the wave does not change shows nothing.
  for (const double period : {3.1416, 4.2361, 5.7446})  // no phase comes twice
    for (const bool down : {false, true}) {
      const auto wave = [&](int r, int c) {
        return 0.1 * std::sin(2 * std::numbers::pi * (down ? r : c) / period);
      };
      double squares = 0;
      for (const int apart : {1, 2}) squares += std::pow(2 * std::sin(std::numbers::pi * apart / period), 6);
      const double expected = std::sqrt(squares / 2 / 20);
      EXPECT_GT(expected, 0.8);
      EXPECT_LT(expected, 1.4);
      // A group of equal clarity may be a quarter of the rows: the phases are even but for a part of a
      // period.
      const double uneven = 4 * period / Positions::kGrid.rows;
      EXPECT_NEAR(Positions(wave).ratio(), expected, uneven * expected) << period << (down ? " down" : "");
    }
}

TEST(ScaleToScatter, LeavesExactAndFewPositionsAlone) {
  Positions exact([](int, int) { return 0.0; });
  std::ranges::fill(exact.map.position[0].values(), 100.0F);
  exact.scale();
  EXPECT_EQ(exact.sigma.at(60, 80), Positions::kStated);
  std::uint64_t counter = 1;
  Positions few([&](int, int) { return 0.1 * normal(counter); });
  std::ranges::fill(few.map.mask.values(), std::uint8_t{0});
  for (int r = 0; r < 10; ++r)
    for (int c = 0; c < 10; ++c) few.map.mask.at(r, c) = 1;
  few.scale();
  EXPECT_EQ(few.sigma.at(5, 5), Positions::kStated);
}

}  // namespace
}  // namespace symrig::calibration::decoder_parts_test
