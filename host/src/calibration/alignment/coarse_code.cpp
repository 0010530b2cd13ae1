// SPDX-License-Identifier: Apache-2.0
#include "calibration/alignment/coarse_code.hpp"

#include "symrig/base/statistics.hpp"

#include <algorithm>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// Narrower blocks have no pixels that see one block only, if the camera has a pixel for each cell.
constexpr int kNarrowest = 4;

Grid block_of(Grid cells) {
  const auto side = [](int count) {
    return std::max(kNarrowest, (count + CoarseCode::kBlocks - 1) / CoarseCode::kBlocks);
  };
  return {side(cells.rows), side(cells.cols)};
}

Grid blocks_of(Grid cells, Grid block) {
  return {(cells.rows + block.rows - 1) / block.rows, (cells.cols + block.cols - 1) / block.cols};
}

}  // namespace

CoarseCode::CoarseCode(Grid cells)
    : cells_(cells), block_(block_of(cells)), code_(blocks_of(cells, block_of(cells))) {}

std::vector<Pattern> CoarseCode::patterns() const {
  std::vector<Pattern> patterns;
  const auto add = [&](int photograph) {
    const Pattern of_blocks = code_.pattern(photograph);
    Pattern pattern(cells_, 1);
    for (int row = 0; row < cells_.rows; ++row)
      for (int col = 0; col < cells_.cols; ++col)
        pattern.at(row, col) = of_blocks.at(row / block_.rows, col / block_.cols);
    patterns.push_back(std::move(pattern));
  };
  for (int pair = 0; pair < code_.pairs(); ++pair) add(2 * pair);
  add(code_.white());
  add(code_.black());
  return patterns;
}

namespace {

/// White less black must be this many of its standard deviations.
constexpr double kBright = 10;
/// At least this share of a pixel's light must follow the stripes, as in StripePixels.
constexpr double kDirect = 0.2;

}  // namespace

CoarsePixels::CoarsePixels(const CoarseCode& code, std::span<const Radiance> photographs, int channel)
    : code_(code),
      photographs_(photographs),
      channel_(channel),
      camera_(photographs.front().mean.grid()),
      blocks_(camera_, 2) {
  tbb::parallel_for(0, camera_.rows, [&](int row) {
    for (int col = 0; col < camera_.cols; ++col) {
      const auto [of_rows, of_cols] = decode(row, col);
      blocks_.at(row, col, 0) = of_rows;
      blocks_.at(row, col, 1) = of_cols;
    }
  });
}

double CoarsePixels::ratio(int row, int col, int pair) const {
  const auto light = [&](std::size_t k) {
    return static_cast<double>(photographs_[k].mean.at(row, col, channel_));
  };
  const double white = light(code_.white()), black = light(code_.black());
  return (2 * light(static_cast<std::size_t>(pair)) - white - black) / (white - black);
}

int CoarsePixels::pair_of(StripeAxis axis, int border) const {
  int pair = axis == StripeAxis::columns ? 0 : code_.code().column_bits();
  // Exactly one bit of a Gray code changes.
  while (code_.code().lit(pair, border - 1) == code_.code().lit(pair, border)) ++pair;
  return pair;
}

std::array<std::int8_t, 2> CoarsePixels::decode(int row, int col) const {
  constexpr std::array<std::int8_t, 2> kNone{-1, -1};
  for (const Radiance& photograph : photographs_)
    if (!photograph.valid.at(row, col, channel_)) return kNone;
  const Radiance &white = photographs_[code_.white()], &black = photographs_[code_.black()];
  const auto at = [&](const Image<float>& image) {
    return static_cast<double>(image.at(row, col, channel_));
  };
  const double light = at(white.mean) - at(black.mean),
               noise = std::sqrt(at(white.variance) + at(black.variance));
  if (!(light > kBright * noise) || !(light > 0)) return kNone;
  const GrayCode& code = code_.code();
  std::array<double, 64> shares;
  std::array<int, 2> block{};
  for (int pair = 0, bit = 0; pair < code.pairs(); ++pair) {
    const bool of_rows = pair >= code.column_bits();
    if (pair == code.column_bits()) bit = 0;
    const double share = ratio(row, col, pair);
    shares[static_cast<std::size_t>(pair)] = std::abs(share);
    bit ^= share > 0 ? 1 : 0;
    int& of_axis = block[of_rows ? 0 : 1];
    of_axis = 2 * of_axis + bit;
  }
  // The few patterns with a border in the pixel show less.
  if (median(std::span(shares).first(static_cast<std::size_t>(code.pairs()))) < kDirect) return kNone;
  if (block[0] >= code_.blocks().rows || block[1] >= code_.blocks().cols) return kNone;
  return {static_cast<std::int8_t>(block[0]), static_cast<std::int8_t>(block[1])};
}

void CoarsePixels::add_edge(int row, int col, bool down, StripeAxis axis,
                            std::vector<CoarseEdge>& edges) const {
  const int next_row = row + (down ? 1 : 0), next_col = col + (down ? 0 : 1);
  const StripeAxis other = axis == StripeAxis::rows ? StripeAxis::columns : StripeAxis::rows;
  const int first = block_of(row, col, axis), second = block_of(next_row, next_col, axis);
  // Where two borders cross, the corner of a block may lie between the pixels.
  if (std::abs(first - second) != 1 || block_of(row, col, other) != block_of(next_row, next_col, other))
    return;
  const int border = std::max(first, second), pair = pair_of(axis, border);
  const double a = ratio(row, col, pair), b = ratio(next_row, next_col, pair);
  if (a * b > 0 || a == b) return;
  const double part = a / (a - b);
  edges.push_back(
      {{row + 0.5 + (down ? part : 0), col + 0.5 + (down ? 0 : part)}, row, col, down, axis, border});
}

std::vector<CoarseEdge> CoarsePixels::edges() const {
  std::vector<std::vector<CoarseEdge>> of_row(static_cast<std::size_t>(camera_.rows));
  tbb::parallel_for(0, camera_.rows, [&](int row) {
    auto& edges = of_row[static_cast<std::size_t>(row)];
    for (int col = 0; col < camera_.cols; ++col) {
      if (!good(row, col)) continue;
      for (const StripeAxis axis : {StripeAxis::rows, StripeAxis::columns}) {
        if (col + 1 < camera_.cols && good(row, col + 1)) add_edge(row, col, false, axis, edges);
        if (row + 1 < camera_.rows && good(row + 1, col)) add_edge(row, col, true, axis, edges);
      }
    }
  });
  std::vector<CoarseEdge> all;
  for (const auto& edges : of_row) all.insert(all.end(), edges.begin(), edges.end());
  return all;
}

}  // namespace symrig::calibration
