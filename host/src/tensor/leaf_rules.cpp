// SPDX-License-Identifier: Apache-2.0
#include "tensor/leaf_rules.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::tensor {

bool range_ok(std::int32_t begin, std::int32_t end, std::int64_t size) {
  return 0 <= begin && begin < end && end <= size;
}

float largest_of(std::span<const float> values) {
  float largest = 0;
  for (const float v : values) largest = std::max(largest, std::abs(v));
  return largest;
}

namespace {

/// True if the range is inside one block. A merged leaf may be as large as the parent of a block of its
/// level.
bool in_one_block(const BlockTree& tree, int level, std::int32_t begin, std::int32_t end) {
  const int parents = std::clamp(level - 1, 0, tree.levels() - 1);
  return tree.block_at(parents, begin) == tree.block_at(parents, end - 1);
}

/// In a symmetric file a leaf is either on the diagonal or completely beside it, so that it does not overlap
/// its mirror image.
bool sides_ok(const Leaf& leaf) {
  const bool same = leaf.row_begin == leaf.col_begin && leaf.row_end == leaf.col_end;
  return same || leaf.row_end <= leaf.col_begin || leaf.col_end <= leaf.row_begin;
}

/// The columns of one channel of a leaf: A, then B.
struct Columns {
  std::span<const float> a, b;
  std::size_t rows, cols, rank;

  std::span<const float> a_of(std::size_t k) const { return a.subspan(k * rows, rows); }
  std::span<const float> b_of(std::size_t k) const { return b.subspan(k * cols, cols); }
};

/// No entry of A Bᵀ is 2^60 or more.
bool products_ok(const Columns& leaf) {
  double sum = 0;
  for (std::size_t k = 0; k < leaf.rank; ++k)
    sum += static_cast<double>(largest_of(leaf.a_of(k))) * static_cast<double>(largest_of(leaf.b_of(k)));
  return sum < static_cast<double>(kLargest);
}

/// Tests A Bᵀ = B Aᵀ by one product with a vector of ±1. Rounding changed each entry of a symmetric leaf by
/// at most 2⁻¹⁰ (1 + 2⁻¹²) Σ|A||B|ᵀ. So the two products differ by at most that share of the sums of
/// magnitudes.
bool leaf_is_symmetric(const Columns& leaf) {
  std::vector<double> difference(leaf.rows), size(leaf.rows);
  const auto sign = [](std::size_t i) { return (i * 0x9E3779B97F4A7C15U >> 63U) != 0 ? -1.0 : 1.0; };
  for (std::size_t k = 0; k < leaf.rank; ++k) {
    const auto a = leaf.a_of(k), b = leaf.b_of(k);
    double lit_a = 0, lit_b = 0, size_a = 0, size_b = 0;
    for (std::size_t i = 0; i < leaf.rows; ++i) {
      lit_a += sign(i) * static_cast<double>(a[i]);
      lit_b += sign(i) * static_cast<double>(b[i]);
      size_a += std::abs(static_cast<double>(a[i]));
      size_b += std::abs(static_cast<double>(b[i]));
    }
    for (std::size_t i = 0; i < leaf.rows; ++i) {
      const auto ai = static_cast<double>(a[i]), bi = static_cast<double>(b[i]);
      difference[i] += ai * lit_b - bi * lit_a;
      size[i] += std::abs(ai) * size_b + std::abs(bi) * size_a;
    }
  }
  const double largest = *std::max_element(size.begin(), size.end());
  for (std::size_t i = 0; i < leaf.rows; ++i)
    if (std::abs(difference[i]) > 0x1p-9 * size[i] + 0x1p-20 * largest) return false;
  return true;
}

}  // namespace

bool leaf_in_place(const Leaf& leaf, const Head& head, const Trees& trees) {
  return (!head.symmetric || sides_ok(leaf)) && range_ok(leaf.row_begin, leaf.row_end, head.camera.size()) &&
         range_ok(leaf.col_begin, leaf.col_end, head.projector.size()) && leaf.level >= 0 &&
         leaf.level < trees.levels() && leaf.rank >= 1 && leaf.rank <= std::min(leaf.rows(), leaf.cols()) &&
         in_one_block(*trees.camera, leaf.level, leaf.row_begin, leaf.row_end) &&
         in_one_block(*trees.projector, leaf.level, leaf.col_begin, leaf.col_end);
}

bool leaf_values_ok(std::span<const float> factors, const Leaf& leaf, const Head& head) {
  const auto rows = static_cast<std::size_t>(leaf.rows()), cols = static_cast<std::size_t>(leaf.cols()),
             rank = static_cast<std::size_t>(leaf.rank);
  const bool diagonal = head.symmetric && leaf.row_begin == leaf.col_begin;
  for (; !factors.empty(); factors = factors.subspan(rank * (rows + cols))) {
    const Columns channel{factors.first(rank * rows), factors.subspan(rank * rows, rank * cols), rows, cols,
                          rank};
    if (!products_ok(channel) || (diagonal && !leaf_is_symmetric(channel))) return false;
  }
  return true;
}

}  // namespace symrig::tensor
