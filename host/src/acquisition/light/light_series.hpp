// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/image/image.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig::acquisition {

/// A photograph with what was lit, all channels added, in raster order.
struct LightPhotograph {
  std::string name;               ///< "a random half"
  std::vector<std::uint8_t> lit;  ///< 1 where the pattern is white
  PagedVector<float> mean, variance;
};

/// Fewer pixels tell nothing.
inline constexpr std::int64_t kFewestPixels = 16;

/// The first photographs of a capture: flood-lit, then those of Checks, in the order in which they were
/// taken.
class LightSeries {
 public:
  /// Their places. The first four patterns after the flood-lit one are random.
  enum Place : std::size_t { kFlood, kHalf, kOtherHalf, kSparse, kOtherSparse, kBar, kPicture, kCount };

  /// checks: may be missing; then only the flood-lit photograph is known.
  LightSeries(const BlockTree& tree, const TreePhotograph& flood, const Checks* checks);

  Grid grid() const { return grid_; }
  std::size_t size() const { return photographs_.size(); }
  const LightPhotograph& operator[](std::size_t k) const { return photographs_[k]; }
  /// 1 where every photograph can be trusted.
  std::span<const std::uint8_t> valid() const { return valid_; }
  std::int64_t pixels() const { return pixels_; }  ///< valid ones

  /// A sum over pixels, and its standard deviation by the variances that are stated.
  struct Sum {
    double value = 0, sigma = 0;
    bool above(double sigmas) const { return value > sigmas * sigma && value > 0; }
    bool below(double sigmas) const { return value < -sigmas * sigma && value < 0; }
  };
  Sum sum(std::size_t k) const;

 private:
  void add(std::string name, const BlockTree& tree, const TreePhotograph& photograph);

  Grid grid_;
  std::vector<LightPhotograph> photographs_;
  std::vector<std::uint8_t> valid_;
  std::int64_t pixels_ = 0;
};

/// The mean of values, and how well it is known from their scatter.
struct LightMean {
  double count = 0, sum = 0, squares = 0;

  void add(double value) { count += 1, sum += value, squares += value * value; }
  double mean() const { return count > 0 ? sum / count : 0; }
  double variance_of_mean() const {
    return count > 1 ? std::max(0.0, squares / count - mean() * mean()) / (count - 1) : 0;
  }
};

/// The light of each photograph as a whole.
class LightSums {
 public:
  explicit LightSums(const LightSeries& series);

  /// Of the light of the flood-lit photograph.
  double share(std::size_t k) const { return light_[k].value / light_[LightSeries::kFlood].value; }
  /// Of the pixels.
  double share_lit(std::size_t k) const { return lit_[k]; }
  /// The relative difference between the brightest photograph and the darkest one.
  double spread() const;
  /// The rms difference between the photographs of the two halves, over their noise.
  double changed() const { return changed_; }

 private:
  std::array<LightSeries::Sum, LightSeries::kCount> light_;
  std::array<double, LightSeries::kCount> lit_{};
  double changed_ = 0;
};

/// How a camera's picture may lie on that of the projector.
enum class Turn : std::uint8_t { none, columns, rows, both, transposed, across, quarter, back };
inline constexpr std::size_t kTurns = 8;

/// Patterns may be this far from their photographs.
inline constexpr int kEarliest = -2, kLatest = 3;

/// The projector pixel that a camera pixel sees, and the camera pixel that sees a projector pixel. The last
/// four turns exchange the sides of a picture: its pixels, one after another, are read as those of the grid.
std::size_t seen_through(Turn turn, Grid grid, int row, int col);
std::size_t seen_at(Turn turn, Grid grid, int row, int col);

/// One way in which photographs may belong to patterns.
struct LightOrder {
  int late = 0;           ///< photograph k shows pattern k - late
  bool inverted = false;  ///< white for black
  Turn turn = Turn::none;

  bool right() const { return late == 0 && !inverted && turn == Turn::none; }
};

/// Fewer pixels tell no order: a correlation must be above 8 / √pixels, and other light than that of the
/// pattern leaves a half of it at best.
inline constexpr std::int64_t kFewestInOrder = 256;

/// How well photographs follow random patterns. A correlation is one of a photograph's pixels with those of a
/// pattern. Without any connection it is a random number of mean 0, and its standard deviation is 1 / √pixels
/// whatever the scene, because the patterns are random.
class LightMatch {
 public:
  explicit LightMatch(const LightSeries& series);

  /// Mean correlation of the four random patterns, as they were shown and in the best other order.
  double as_shown() const { return as_shown_; }
  double best() const { return best_; }
  const LightOrder& order() const { return order_; }
  /// The photographs follow their patterns in another order, far better than as they were shown.
  bool elsewhere() const;
  /// The photographs follow their patterns.
  bool follows() const;
  /// A photograph that shows another pattern than its own, although most show their own: {photograph,
  /// pattern}.
  std::optional<std::array<std::size_t, 2>> exchanged() const;
  /// Of photograph k with the random pattern x.
  double correlation(std::size_t k, std::size_t x, Turn turn) const;

 private:
  double mean_of(const LightOrder& order) const;

  std::vector<double> table_;  // [turn][photograph][pattern]
  double as_shown_ = 0, best_ = 0, sigma_ = 1;
  LightOrder order_;
};

/// Light that pairs of the patterns exchange, qᵀ T p and pᵀ T q, which are equal for a symmetric T.
struct ExchangedLight {
  double difference = 0;  ///< rms, as a share of the rms light exchanged
  bool significant = false;
};
ExchangedLight exchanged_light(const LightSeries& series);

}  // namespace symrig::acquisition
