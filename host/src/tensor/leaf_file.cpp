// SPDX-License-Identifier: Apache-2.0
#include "tensor/leaf_file.hpp"

#include "symrig/tensor/internal/half.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

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

Error breaks_rules(std::size_t leaf) {
  return damaged(fmt::format("leaf {} in 'leaves' breaks the rules of the format", leaf));
}

namespace {

/// The columns of a leaf have values for all its pixels, and no value is left over.
Result<void> check_sizes(std::span<const Leaf> leaves, const Head& head, std::size_t values,
                         std::size_t exponents) {
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    const std::size_t columns = leaves[k].columns(head.channels);
    const std::size_t scales = head.version == 1 ? 0 : columns;  // floats have no exponents
    // A division, because the product of two wrong numbers may be too large for any integer.
    const auto pixels = static_cast<std::size_t>(std::int64_t{leaves[k].rows()} + leaves[k].cols());
    if (columns / 2 > values / pixels || scales > exponents) return breaks_rules(k);
    values -= leaves[k].values(head.channels);
    exponents -= scales;
  }
  if (values > 0) return damaged("'leaves/factors' has values without a leaf");
  if (exponents > 0) return damaged("'leaves/exponents' has values without a leaf");
  return {};
}

/// Some leaves of the list. All at once would need twice the memory of the leaves.
class LeafRun {
 public:
  static constexpr std::size_t kMost = std::size_t{1} << 20;  ///< whole chunks of the file

  Result<void> read(const Object& file, std::size_t first, std::size_t count) {
    range_.resize(4 * count);
    rank_.resize(count);
    level_.resize(count);
    SYMRIG_CHECK(h5::read_rows<std::int32_t>(file, "leaves/range", first, 4, range_));
    SYMRIG_CHECK(h5::read_rows<std::int32_t>(file, "leaves/rank", first, 1, rank_));
    return h5::read_rows<std::int32_t>(file, "leaves/level", first, 1, level_);
  }
  std::size_t size() const { return rank_.size(); }
  Leaf leaf(std::size_t k) const {
    const std::int32_t* const r = &range_[4 * k];
    return {r[0], r[1], r[2], r[3], rank_[k], level_[k]};
  }

 private:
  std::vector<std::int32_t> range_, rank_, level_;
};

/// The largest magnitude of a column; none if it is no number that a file may hold.
std::optional<double> largest_of_column(std::span<const Half> column, std::int32_t exponent) {
  if (exponent < -200 || exponent > 200) return std::nullopt;
  const double largest = std::ldexp(static_cast<double>(from_half(largest_half(column))), exponent);
  if (largest > static_cast<double>(std::numeric_limits<float>::max())) return std::nullopt;
  return largest;
}

/// The rules for the values of one leaf (leaf_values_ok), without floats of them.
bool halves_ok(std::span<const Half> halves, std::span<const std::int32_t> exponents, const Leaf& leaf,
               int channels) {
  for (int channel = 0; channel < channels; ++channel) {
    std::vector<double> product(leaf.rank, 1);
    for (const std::int32_t side : {leaf.rows(), leaf.cols()}) {
      for (double& largest : product) {
        const auto found = largest_of_column(halves.first(static_cast<std::size_t>(side)), exponents.front());
        if (!found) return false;
        largest *= *found;
        halves = halves.subspan(static_cast<std::size_t>(side));
        exponents = exponents.subspan(1);
      }
    }
    double sum = 0;
    for (const double largest : product) sum += largest;
    if (sum >= static_cast<double>(kLargest)) return false;
  }
  return true;
}

/// The floats of one leaf.
std::vector<float> floats_of(std::span<const Half> halves, std::span<const std::int32_t> exponents,
                             const Leaf& leaf, int channels) {
  std::vector<float> floats;
  floats.reserve(halves.size());
  for (int channel = 0; channel < channels; ++channel)
    for (const std::int32_t side : {leaf.rows(), leaf.cols()})
      for (std::int32_t k = 0; k < leaf.rank; ++k, exponents = exponents.subspan(1)) {
        const auto column = halves.first(static_cast<std::size_t>(side));
        halves = halves.subspan(static_cast<std::size_t>(side));
        for (const Half v : column) floats.push_back(std::ldexp(from_half(v), exponents.front()));
      }
  return floats;
}

Result<void> check_part(const PartValues& values, const PartRange& part, std::span<const Leaf> leaves,
                        const Head& head) {
  if (largest_half(values.halves) >= 0x7C00U)
    return impossible("dataset 'leaves/factors' has a value that is not a finite number");
  std::span<const Half> halves = values.halves;
  std::span<const std::int32_t> exponents = values.exponents;
  for (std::size_t k = 0; k < leaves.size(); ++k) {
    const auto of_leaf = halves.first(leaves[k].values(head.channels));
    const auto scales = exponents.first(leaves[k].columns(head.channels));
    if (!halves_ok(of_leaf, scales, leaves[k], head.channels)) return breaks_rules(part.first + k);
    // Only a block with itself has further rules, and few leaves are one.
    if (head.symmetric && leaves[k].row_begin == leaves[k].col_begin &&
        !leaf_values_ok(floats_of(of_leaf, scales, leaves[k], head.channels), leaves[k], head))
      return breaks_rules(part.first + k);
    halves = halves.subspan(of_leaf.size());
    exponents = exponents.subspan(scales.size());
  }
  return {};
}

}  // namespace

Result<std::vector<Leaf>> read_leaf_list(const Object& file, const Head& head, const Trees& trees) {
  constexpr std::size_t kNumber = sizeof(std::int32_t);
  SYMRIG_TRY(const h5::Shape range, h5::shape_of(file, "leaves/range", 2, kNumber));
  if (range[1] != 4) return damaged("dataset 'leaves/range' does not have four columns");
  const std::size_t n = range[0];
  SYMRIG_TRY(const h5::Shape rank, h5::shape_of(file, "leaves/rank", 1, kNumber));
  SYMRIG_TRY(const h5::Shape level, h5::shape_of(file, "leaves/level", 1, kNumber));
  if (rank[0] != n || level[0] != n) return damaged("the datasets in 'leaves' differ in length");
  std::vector<Leaf> leaves;
  leaves.reserve(n);
  LeafRun run;
  do {
    SYMRIG_CHECK(run.read(file, leaves.size(), std::min(n - leaves.size(), LeafRun::kMost)));
    for (std::size_t k = 0; k < run.size(); ++k) {
      leaves.push_back(run.leaf(k));
      if (!leaf_in_place(leaves.back(), head, trees)) return breaks_rules(leaves.size() - 1);
    }
  } while (leaves.size() < n);
  const std::size_t value_bytes = head.version == 1 ? sizeof(float) : sizeof(Half);
  SYMRIG_TRY(const h5::Shape values, h5::shape_of(file, "leaves/factors", 1, value_bytes));
  h5::Shape exponents{0};
  if (head.version > 1) {
    SYMRIG_TRY(exponents, h5::shape_of(file, "leaves/exponents", 1, sizeof(std::int32_t)));
  }
  SYMRIG_CHECK(check_sizes(leaves, head, values[0], exponents[0]));
  return leaves;
}

Result<void> LeafReader::read(const PartRange& part, std::span<const Leaf> leaves, PartValues& to) const {
  to.halves.resize(part.values);
  to.exponents.resize(part.columns);
  SYMRIG_CHECK(h5::read_rows<Half>(file_, "leaves/factors", part.first_value, 1, to.halves));
  SYMRIG_CHECK(h5::read_rows<std::int32_t>(file_, "leaves/exponents", part.first_column, 1, to.exponents));
  return check_part(to, part, leaves, head_);
}

Result<void> LeafFile::read(const PartRange& part, std::span<const Leaf> leaves, PartValues& to) const {
  auto outcome = reader_.read(part, leaves, to);
  if (outcome) return outcome;
  Error error = std::move(outcome).error();
  error.what = path_ + ": " + error.what;
  if (error.hint.empty()) error.hint = "the file is damaged; capture or fit the scene again";
  return error;
}

}  // namespace symrig::tensor
