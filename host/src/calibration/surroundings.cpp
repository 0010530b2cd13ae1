// SPDX-License-Identifier: Apache-2.0
#include "calibration/surroundings.hpp"

#include <algorithm>
#include <numeric>
#include <set>

namespace symrig::calibration {
namespace {

/// Largest level at which blocks are at least `size` pixels wide. Every level above the single pixels is a
/// product of row and column bands, because all blocks of one band split equally.
int level_of(const BlockTree& tree, int size) {
  int level = 0;
  while (level + 1 < tree.levels() && tree.grid().cols >> (level + 1) >= size &&
         tree.grid().rows >> (level + 1) >= 1)
    ++level;
  return level;
}

/// Middle of each block. starts: the first pixel of each block, and the end.
std::vector<double> centres_of(const std::vector<int>& starts) {
  std::vector<double> centres;
  for (std::size_t i = 0; i + 1 < starts.size(); ++i)
    centres.push_back(0.5 * (starts[i] + starts[i + 1] - 1));
  return centres;
}

std::size_t band(const std::vector<int>& starts, int at) {
  return static_cast<std::size_t>(std::ranges::upper_bound(starts, at) - starts.begin()) - 1;
}

}  // namespace

Surroundings::Surroundings(const BlockTree& tree, int size) {
  const auto level = tree.level(level_of(tree, size));
  std::set<int> rows{tree.grid().rows}, cols{tree.grid().cols};
  for (const Block& b : level) {
    rows.insert(b.row);
    cols.insert(b.col);
  }
  row_starts_.assign(rows.begin(), rows.end());
  col_starts_.assign(cols.begin(), cols.end());
  row_centres_ = centres_of(row_starts_);
  col_centres_ = centres_of(col_starts_);
  blocks_.resize(level.size());
  for (const Block& b : level)
    blocks_[band(row_starts_, b.row) * (col_starts_.size() - 1) + band(col_starts_, b.col)] = &b;
}

std::vector<float> Surroundings::means(std::span<const float> values, const std::vector<int>& starts) {
  std::vector<float> result;
  result.reserve(starts.size());
  for (std::size_t i = 0; i + 1 < starts.size(); ++i)
    result.push_back(std::accumulate(values.begin() + starts[i], values.begin() + starts[i + 1], 0.0F) /
                     static_cast<float>(starts[i + 1] - starts[i]));
  return result;
}

Taps Surroundings::linear_taps(double position, const std::vector<double>& centres) {
  const auto after = std::ranges::upper_bound(centres.begin() + 1, centres.end(), position);
  const auto below = after - 1;
  Taps taps;
  taps.first = static_cast<int>(below - centres.begin());
  taps.count = after == centres.end() ? 1 : 2;
  const double share = taps.count == 1 ? 0 : std::clamp((position - *below) / (*after - *below), 0.0, 1.0);
  taps.weight[0] = static_cast<float>(1 - share);
  taps.weight[1] = static_cast<float>(share);
  return taps;
}

}  // namespace symrig::calibration
