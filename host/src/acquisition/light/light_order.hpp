// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_series.hpp"

#include <array>
#include <cstddef>
#include <optional>

namespace symrig::acquisition {

/// How a camera's picture may lie on that of the projector.
enum class Turn : std::uint8_t { none, columns, rows, both, transposed, across, quarter, back };

/// Patterns may be this far from their photographs.
inline constexpr int kEarliest = -2, kLatest = 3;

/// The pixel of the projector that a camera pixel sees. grid: square for the last four.
std::size_t seen_through(Turn turn, Grid grid, int row, int col);

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

  const LightSeries& series_;
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
