// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_series.hpp"

#include "acquisition/light/light_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

namespace symrig::acquisition {

LightSeries::LightSeries(const BlockTree& tree, const TreePhotograph& flood, const Checks* checks)
    : grid_(tree.grid()), valid_(tree.order().size(), 1) {
  constexpr std::array<const char*, Checks::kCount> kNames{"a random half", "the other half", "a random 1/32",
                                                           "another 1/32",  "a bar",          "a picture"};
  add("all pixels", tree, flood);
  if (checks != nullptr)
    for (std::size_t k = 0; k < kNames.size(); ++k) add(kNames[k], tree, checks->photographs()[k].photograph);
  pixels_ = std::ranges::count(valid_, std::uint8_t{1});
}

void LightSeries::add(std::string name, const BlockTree& tree, const TreePhotograph& photograph) {
  const auto order = tree.order();
  const std::size_t pixels = order.size();
  LightPhotograph one{std::move(name), std::vector<std::uint8_t>(pixels), PagedVector<float>(pixels, 0.0F),
                      PagedVector<float>(pixels, 0.0F)};
  for (std::size_t t = 0; t < pixels; ++t) {
    const auto at = static_cast<std::size_t>(order[t]);
    one.lit[at] = photograph.pattern[t] > 0 ? 1 : 0;
    for (std::size_t sample = t; sample < photograph.mean.size(); sample += pixels) {
      one.mean[at] += photograph.mean[sample];
      one.variance[at] += photograph.variance[sample];
      if (photograph.valid[sample] == 0) valid_[at] = 0;
    }
  }
  photographs_.push_back(std::move(one));
}

LightSeries::Sum LightSeries::sum(std::size_t k) const {
  const LightPhotograph& one = photographs_[k];
  double value = 0, variance = 0;
  for (std::size_t at = 0; at < valid_.size(); ++at) {
    if (valid_[at] == 0) continue;
    value += static_cast<double>(one.mean[at]);
    variance += static_cast<double>(one.variance[at]);
  }
  return {value, std::sqrt(variance)};
}

LightSums::LightSums(const LightSeries& series) {
  for (std::size_t k = 0; k < LightSeries::kCount; ++k) {
    light_[k] = series.sum(k);
    const auto lit = std::ranges::count(series[k].lit, std::uint8_t{1});
    lit_[k] = static_cast<double>(lit) / static_cast<double>(series[k].lit.size());
  }
  double squares = 0, noise = 0;
  const LightPhotograph &half = series[LightSeries::kHalf], &other = series[LightSeries::kOtherHalf];
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    if (series.valid()[at] == 0) continue;
    const double difference = static_cast<double>(half.mean[at]) - static_cast<double>(other.mean[at]);
    squares += difference * difference;
    noise += static_cast<double>(half.variance[at]) + static_cast<double>(other.variance[at]);
  }
  if (squares > 0)
    changed_ = noise > 0 ? std::sqrt(squares / noise) : std::numeric_limits<double>::infinity();
}

double LightSums::spread() const {
  const auto [least, most] =
      std::ranges::minmax_element(light_, {}, [](const LightSeries::Sum& one) { return one.value; });
  return most->value > 0 ? 1 - least->value / most->value : std::numeric_limits<double>::infinity();
}

namespace {

constexpr std::size_t kRandom = 4;
/// A mean of four correlations has at most twice the standard deviation of one: the halves are complements.
constexpr double kOrderSigmas = 8;
/// How much better another order must be. A pattern that scatters light has no direct light, but never more
/// elsewhere than in place.
constexpr double kBetter = 2;

std::size_t in_table(std::size_t turn, std::size_t k, std::size_t x) {
  return (turn * LightSeries::kCount + k) * kRandom + x;
}

double correlate(const LightSeries& series, const LightPhotograph& seen, const LightPhotograph& shown,
                 Turn turn) {
  const Grid grid = series.grid();
  double n = 0, x = 0, y = 0, xy = 0, yy = 0;
  std::size_t at = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col, ++at) {
      if (series.valid()[at] == 0) continue;
      const double light = seen.mean[at], lit = shown.lit[seen_through(turn, grid, row, col)];
      n += 1, x += lit, y += light, xy += lit * light, yy += light * light;
    }
  const double spread = (x - x * x / n) * (yy - y * y / n);
  return spread > 0 ? (xy - x * y / n) / std::sqrt(spread) : 0;
}

std::size_t place_in(Grid grid, int row, int col) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(grid.cols) + static_cast<std::size_t>(col);
}

}  // namespace

std::size_t seen_through(Turn turn, Grid grid, int row, int col) {
  const int pixel = row * grid.cols + col;
  const int tall = pixel / grid.rows, wide = pixel % grid.rows;  // of a picture whose sides are exchanged
  switch (turn) {
    case Turn::columns:
      return place_in(grid, row, grid.cols - 1 - col);
    case Turn::rows:
      return place_in(grid, grid.rows - 1 - row, col);
    case Turn::both:
      return place_in(grid, grid.rows - 1 - row, grid.cols - 1 - col);
    case Turn::transposed:
      return place_in(grid, wide, tall);
    case Turn::across:
      return place_in(grid, grid.rows - 1 - wide, grid.cols - 1 - tall);
    case Turn::quarter:
      return place_in(grid, wide, grid.cols - 1 - tall);
    case Turn::back:
      return place_in(grid, grid.rows - 1 - wide, tall);
    case Turn::none:
      break;
  }
  return place_in(grid, row, col);
}

std::size_t seen_at(Turn turn, Grid grid, int row, int col) {
  // In a picture whose sides are exchanged, rows come from columns.
  const Grid exchanged{grid.cols, grid.rows};
  const int tall = col, wide = row, tall_back = grid.cols - 1 - col, wide_back = grid.rows - 1 - row;
  switch (turn) {
    case Turn::transposed:
      return place_in(exchanged, tall, wide);
    case Turn::across:
      return place_in(exchanged, tall_back, wide_back);
    case Turn::quarter:
      return place_in(exchanged, tall_back, wide);
    case Turn::back:
      return place_in(exchanged, tall, wide_back);
    default:
      return seen_through(turn, grid, row, col);  // its own inverse
  }
}

LightMatch::LightMatch(const LightSeries& series)
    : table_(kTurns * LightSeries::kCount * kRandom),
      sigma_(1 / std::sqrt(static_cast<double>(std::max<std::int64_t>(series.pixels(), 1)))) {
  tbb::parallel_for(std::size_t{0}, kTurns * LightSeries::kCount * kRandom, [&](std::size_t job) {
    const std::size_t x = job % kRandom, k = job / kRandom % LightSeries::kCount,
                      turn = job / kRandom / LightSeries::kCount;
    table_[job] = correlate(series, series[k], series[LightSeries::kHalf + x], static_cast<Turn>(turn));
  });
  as_shown_ = mean_of({});
  for (std::size_t turn = 0; turn < kTurns; ++turn)
    for (int late = kEarliest; late <= kLatest; ++late)
      for (const bool inverted : {false, true}) {
        const LightOrder order{late, inverted, static_cast<Turn>(turn)};
        const double mean = mean_of(order);
        if (order.right() || mean <= best_) continue;
        best_ = mean;
        order_ = order;
      }
}

double LightMatch::correlation(std::size_t k, std::size_t x, Turn turn) const {
  return table_[in_table(static_cast<std::size_t>(turn), k, x - LightSeries::kHalf)];
}

double LightMatch::mean_of(const LightOrder& order) const {
  double sum = 0, count = 0;
  for (int x = LightSeries::kHalf; x <= static_cast<int>(LightSeries::kOtherSparse); ++x) {
    const int k = x + order.late;
    if (k < 0 || k >= static_cast<int>(LightSeries::kCount)) continue;
    sum += correlation(static_cast<std::size_t>(k), static_cast<std::size_t>(x), order.turn);
    count += 1;
  }
  return (order.inverted ? -1 : 1) * sum / count;
}

bool LightMatch::elsewhere() const {
  return best_ > kOrderSigmas * sigma_ && best_ > kBetter * std::max(as_shown_, 0.0);
}

bool LightMatch::follows() const {
  return as_shown_ > kOrderSigmas * sigma_;
}

std::optional<std::array<std::size_t, 2>> LightMatch::exchanged() const {
  if (!follows()) return std::nullopt;
  for (std::size_t k = LightSeries::kHalf; k <= LightSeries::kPicture; ++k) {
    const double own = k <= LightSeries::kOtherSparse ? std::max(correlation(k, k, Turn::none), 0.0) : 0;
    for (std::size_t x = LightSeries::kHalf; x <= LightSeries::kOtherSparse; ++x) {
      const double other = correlation(k, x, Turn::none);
      if (x != k && other > as_shown_ / kBetter && other > kOrderSigmas * sigma_ && other > kBetter * own)
        return std::array{k, x};
    }
  }
  return std::nullopt;
}

ExchangedLight exchanged_light(const LightSeries& series) {
  constexpr double kRounding = 1e-4;  // a float photograph
  double squares = 0, noise = 0, light = 0;
  for (std::size_t p = LightSeries::kHalf; p < LightSeries::kCount; ++p)
    for (std::size_t q = p + 1; q < LightSeries::kCount; ++q) {
      double there = 0, back = 0, variance = 0;
      for (std::size_t at = 0; at < series.valid().size(); ++at) {
        if (series.valid()[at] == 0) continue;
        if (series[q].lit[at] != 0) there += series[p].mean[at], variance += series[p].variance[at];
        if (series[p].lit[at] != 0) back += series[q].mean[at], variance += series[q].variance[at];
      }
      squares += (there - back) * (there - back);
      light += (there + back) * (there + back) / 4;
      noise += variance;
    }
  if (!(light > 0)) return {};
  const double rounding = kRounding * kRounding * light;
  return {std::sqrt(std::max(0.0, squares - noise) / light), squares > kLightSigmas * noise + rounding};
}

}  // namespace symrig::acquisition
