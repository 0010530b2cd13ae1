// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_fit/row_prior.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace symrig::calibration {
namespace {

constexpr double kDirectSpread = 0.5;    ///< of the direct light that the footprint foretells
constexpr double kStraySpread = 0.02;    ///< of the pixel's light, where its footprint is at all
constexpr double kLeastShare = 2e-3;     ///< of the footprint in a cell
constexpr double kSingleSpread = 1.5;    ///< of light from a single cell
constexpr std::size_t kMostEdges = 128;  ///< cells that an edge may show: the strongest
constexpr double kLeastNear = 1e-4;      ///< of the cell's light, from a cell two away
constexpr double kWideBlur = 0.25;       ///< [cells] direct light then comes from two cells away

}  // namespace

std::size_t RowPrior::number_of(std::int32_t cell) {
  const auto at = std::ranges::lower_bound(placed_, cell, {}, &std::pair<std::int32_t, std::size_t>::first);
  if (at != placed_.end() && at->first == cell) return at->second;
  placed_.insert(at, {cell, columns_.size()});
  columns_.push_back(-1 - cell);
  terms_.emplace_back();
  return columns_.size() - 1;
}

void RowPrior::add_leaves(std::int32_t cell) {
  for (const LeafRow& at : rows_.leaves(cell)) {
    const LeafRows& leaf = rows_.leaf(at.leaf);
    for (std::int32_t k = 0; k < leaf.basis.rank; ++k) {
      const double a = leaf.a(at.row, k), rms = leaf.rms(k);
      columns_.push_back(leaf.basis.first + k);
      terms_.push_back({.mean = a, .spread = std::sqrt((a * a + rms * rms) / 2)});
    }
  }
}

/// How large the light from near cell k may be, by what this cell and its neighbours get from there and from
/// the opposite side: root mean square, half of it by this cell alone. T on the cells may have missed it in
/// one cell.
double RowPrior::near_light(int row, int col, int k) const {
  const Grid grid = rows_.grid();
  const int last = CellRows::side * CellRows::side - 1;
  double sum = 0, count = 0;
  for (int y = std::max(row - 1, 0); y <= std::min(row + 1, grid.rows - 1); ++y)
    for (int x = std::max(col - 1, 0); x <= std::min(col + 1, grid.cols - 1); ++x) {
      const std::int32_t c = y * grid.cols + x;
      if (!rows_.seen(c)) continue;
      const double scale = total_ / rows_.brightness(c);
      for (const int j : {k, last - k}) {
        const double light = scale * rows_.near(c)[j];
        sum += light * light;
        ++count;
      }
    }
  const double own = rows_.near(row * grid.cols + col)[k];
  return std::sqrt((own * own + sum / count) / 2);
}

void RowPrior::add_near(std::int32_t cell, double blur) {
  const Grid grid = rows_.grid();
  const int row = cell / grid.cols, col = cell % grid.cols;
  for (int k = 0; k < CellRows::side * CellRows::side; ++k) {
    const int dy = k / CellRows::side - CellRows::radius, dx = k % CellRows::side - CellRows::radius;
    const int y = row + dy, x = col + dx;
    if (y < 0 || x < 0 || y >= grid.rows || x >= grid.cols) continue;
    const std::int32_t n = y * grid.cols + x;
    const double light = n == cell ? 0 : near_light(row, col, k);
    const bool far = std::max(std::abs(dy), std::abs(dx)) == CellRows::radius;
    if (far && blur < kWideBlur && light < kLeastNear * total_) continue;
    Term& term = terms_[number_of(n)];
    term.near = k;
    const std::int32_t like = rows_.seen(n) ? n : cell;
    term.direct = std::clamp(rows_.diagonal(like) / rows_.brightness(like), 0.0, 1.0);
    term.spread = light;
  }
}

void RowPrior::add_singles(std::int32_t cell) {
  for (const CellRows::Entry& entry : rows_.single(cell)) {
    if (entry.cell == cell) continue;
    Term& term = terms_[number_of(entry.cell)];
    term.mean += entry.value;
    if (term.near < 0) term.spread = kSingleSpread * std::abs(static_cast<double>(entry.value));
  }
}

void RowPrior::add_edges(std::int32_t cell) {
  const Grid grid = rows_.grid();
  const int row = cell / grid.cols, col = cell % grid.cols;
  const auto around = [&](int y, int x, auto&& use) {
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx)
        if (y + dy >= 0 && y + dy < grid.rows && x + dx >= 0 && x + dx < grid.cols) use(y + dy, x + dx);
  };
  edges_.clear();
  around(row, col, [&](int y, int x) {
    if (!rows_.seen(y * grid.cols + x)) return;
    for (const CellRows::Entry& strong : rows_.strong(y * grid.cols + x))
      around(strong.cell / grid.cols, strong.cell % grid.cols, [&](int my, int mx) {
        if (std::abs(my - row) <= 1 && std::abs(mx - col) <= 1) return;
        edges_.push_back({my * grid.cols + mx, strong.value});
      });
  });
  using Entry = CellRows::Entry;
  std::ranges::sort(edges_, [](const Entry& a, const Entry& b) {
    return std::pair(a.cell, b.value) < std::pair(b.cell, a.value);
  });
  const auto same = [](const Entry& a, const Entry& b) { return a.cell == b.cell; };
  edges_.erase(std::unique(edges_.begin(), edges_.end(), same), edges_.end());
  std::ranges::sort(edges_, [](const Entry& a, const Entry& b) {
    return std::pair(b.value, a.cell) < std::pair(a.value, b.cell);
  });
  for (std::size_t k = 0; k < std::min(edges_.size(), kMostEdges); ++k)
    terms_[number_of(edges_[k].cell)].least = edges_[k].value;
}

void RowPrior::begin(std::int32_t cell, double blur) {
  columns_.clear();
  terms_.clear();
  placed_.clear();
  total_ = rows_.brightness(cell);
  add_leaves(cell);
  add_near(cell, blur);
  add_singles(cell);
  add_edges(cell);
}

void RowPrior::of_pixel(const Footprint& footprint, double light, Eigen::VectorXd& mean,
                        Eigen::VectorXd& sigma) const {
  light = std::max(light, 1e-3 * total_);
  const double u = light / total_;
  mean.resize(static_cast<Eigen::Index>(terms_.size()));
  sigma.resize(mean.size());
  for (Eigen::Index k = 0; k < mean.size(); ++k) {
    const Term& term = terms_[k];
    const double share = term.near < 0 ? 0 : footprint.share[term.near];
    const double direct = share * term.direct;
    mean(k) = term.mean * u + light * direct;
    const double stray = share > kLeastShare ? kStraySpread : 0;
    sigma(k) = std::max(light * (kDirectSpread * direct + stray) + term.spread * u, term.least * u);
  }
}

}  // namespace symrig::calibration
