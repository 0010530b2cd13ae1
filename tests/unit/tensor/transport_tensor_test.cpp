// SPDX-License-Identifier: Apache-2.0
#include "symrig/tensor/transport_tensor.hpp"

#include "dense_scene.hpp"
#include "unit/tensor/random_tensor.hpp"

#include <array>
#include <numeric>
#include <ostream>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::transport_tensor_test {
namespace {

using tests::RandomTensor;
using tests::TensorAndMatrix;

constexpr double kEpsilon = 0x1p-24;
/// Both factors of a product rounded to halves, relative to Σ|A||B|ᵀ; the factors of these tests are far
/// above the 2⁻³² of their largest where the absolute part of the bound would count.
constexpr double kStored = 0x1p-10 * (1 + 0x1p-11);

struct Case {
  Grid camera, projector;
  bool symmetric;
  int level, rank, scalars;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << to_string(c.camera) << " from " << to_string(c.projector) << (c.symmetric ? " symmetric" : "")
       << " level " << c.level << " rank " << c.rank << " scalars " << c.scalars;
}

class AnyTensor : public testing::TestWithParam<Case> {
 protected:
  static TensorAndMatrix make() {
    const Case& c = GetParam();
    return RandomTensor(c.camera, c.projector, c.symmetric, 1, 5).make(c.level, c.rank, c.scalars);
  }
  static std::vector<float> random_vector(std::int64_t size, std::uint64_t seed) {
    Random random(seed);
    std::vector<float> v(size);
    for (float& x : v) x = static_cast<float>(random.uniform() - 0.3);
    return v;
  }
  /// The cards of TransportTensor and apply: storing, and (|J| + leaves on the path + 4) ε Σ|A||B|ᵀ|p|. Every
  /// pixel lies in at most `leaves` leaves.
  static double bound(const TensorAndMatrix& made, double magnitude) {
    const auto leaves = static_cast<double>(made.tensor.leaves().size() + made.tensor.scalars().size());
    return (kStored + (made.longest + leaves + 4) * kEpsilon) * magnitude + 1e-30;
  }
};

INSTANTIATE_TEST_SUITE_P(
    Kinds, AnyTensor,
    testing::Values(Case{{9, 13}, {9, 13}, true, 2, 1, 40}, Case{{9, 13}, {9, 13}, true, 1, 3, 0},
                    Case{{9, 13}, {7, 5}, false, 2, 2, 60}, Case{{1, 1}, {1, 1}, true, 0, 1, 2},
                    Case{{1, 17}, {1, 17}, true, 3, 1, 9}, Case{{16, 16}, {16, 16}, true, 0, 4, 100}));

TEST_P(AnyTensor, apply_equals_the_matrix) {
  const TensorAndMatrix made = make();
  const auto p = random_vector(made.tensor.projector_grid().size(), 1);
  std::vector<float> y(made.tensor.camera_grid().size());
  made.tensor.apply_tree(p, y, 0, false);
  for (std::size_t i = 0; i < y.size(); ++i) {
    double exact = 0, size = 0;
    for (std::size_t j = 0; j < p.size(); ++j) {
      exact += made.matrix[i * made.cols + j] * double{p[j]};
      size += made.magnitude[i * made.cols + j] * std::abs(double{p[j]});
    }
    EXPECT_LE(std::abs(double{y[i]} - exact), bound(made, size)) << "pixel " << i;
  }
}

TEST_P(AnyTensor, transposed_apply_equals_the_transposed_matrix) {
  const TensorAndMatrix made = make();
  const auto light = random_vector(made.tensor.camera_grid().size(), 2);
  std::vector<float> y(made.tensor.projector_grid().size());
  made.tensor.apply_tree(light, y, 0, true);
  for (std::size_t j = 0; j < y.size(); ++j) {
    double exact = 0, size = 0;
    for (std::size_t i = 0; i < light.size(); ++i) {
      exact += made.matrix[i * made.cols + j] * double{light[i]};
      size += made.magnitude[i * made.cols + j] * std::abs(double{light[i]});
    }
    EXPECT_LE(std::abs(double{y[j]} - exact), bound(made, size)) << "pixel " << j;
  }
}

TEST_P(AnyTensor, apply_and_transposed_apply_are_adjoint) {
  const TensorAndMatrix made = make();
  Image<float> p(made.tensor.projector_grid()), light(made.tensor.camera_grid());
  Random random(9);
  for (float& v : p.values()) v = static_cast<float>(random.uniform());
  for (float& v : light.values()) v = static_cast<float>(random.uniform());
  const auto y = made.tensor.apply(p);
  const auto x = made.tensor.apply_transposed(light);
  ASSERT_TRUE(y.ok() && x.ok());
  const auto dot = [](std::span<const float> a, std::span<const float> b) {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += double{a[i]} * double{b[i]};
    return sum;
  };
  const double total =
      std::accumulate(made.magnitude.begin(), made.magnitude.end(), 0.0);  // ≥ Σ light |T| p, both in [0, 1]
  EXPECT_NEAR(dot(y->values(), light.values()), dot(p.values(), x->values()), 2 * bound(made, total));
}

TEST(TransportTensor, symmetric_tensor_needs_no_transpose) {
  const auto made = RandomTensor({11, 6}, {}, true, 3, 8).make(2, 2, 30);
  Image<float> p(made.tensor.projector_grid());
  Random random(4);
  for (float& v : p.values()) v = static_cast<float>(random.uniform());
  EXPECT_EQ(made.tensor.apply(p)->values().size(), made.tensor.apply_transposed(p)->values().size());
  const auto forward = made.tensor.apply(p);
  const auto backward = made.tensor.apply_transposed(p);
  EXPECT_EQ(*forward, *backward);
}

TEST(TransportTensor, wide_columns_spread_over_their_block) {
  const BlockTree camera(Grid{2, 2}), projector(Grid{2, 4});
  TensorBuilder builder(camera, projector, 1);
  builder.add_column(0, 4, std::vector<std::int32_t>{1, 3}, std::vector<float>{2, 5});
  const TransportTensor tensor = std::move(builder).finish();
  std::vector<float> p(8, 1.0F), y(4);
  tensor.apply_tree(p, y, 0, false);
  EXPECT_EQ(y, (std::vector<float>{0, 8, 0, 20}));
  std::vector<float> light{0, 1, 0, 1}, x(8);
  tensor.apply_tree(light, x, 0, true);
  EXPECT_EQ(x, (std::vector<float>{7, 7, 7, 7, 0, 0, 0, 0}));
}

TEST(TransportTensor, a_pattern_in_memory_of_the_caller_gives_the_same_photograph) {
  const auto made = RandomTensor({5, 4}, {}, true, 2, 8).make(1, 1, 3);
  Image<float> pattern(Grid{5, 4});
  std::iota(pattern.values().begin(), pattern.values().end(), 0.5F);
  const auto photograph = made.tensor.apply_values(pattern.values());
  ASSERT_TRUE(photograph.ok());
  EXPECT_EQ(*photograph, *made.tensor.apply(pattern));
  const auto refused = made.tensor.apply_values(pattern.values().first(19));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().code, ErrorCode::size_mismatch);
  EXPECT_NE(refused.error().what.find("19 pixels"), std::string::npos);
}

TEST(TransportTensor, a_pattern_of_another_size_is_refused_by_name) {
  const auto made = RandomTensor({4, 4}, {}, true, 1, 8).make(1, 1, 3);
  const auto answer = made.tensor.apply(Image<float>(Grid{4, 5}));
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().code, ErrorCode::size_mismatch);
  EXPECT_NE(answer.error().what.find("4x5"), std::string::npos);
  EXPECT_NE(answer.error().what.find("4x4"), std::string::npos);
}

TEST(TransportTensor, stopped_at_a_level_keeps_the_flood_lit_photograph) {
  // c (Σr)/s = c while Σc = Σr, and both are sums of the same entries: stopping early moves light inside
  // blocks, never in or out.
  const auto made = RandomTensor({12, 10}, {}, true, 1, 21, 0.0).make(3, 1, 200);  // light: Σc > 0
  const Image<float> flood(Grid{12, 10}, 1, 1.0F);
  const auto exact = made.tensor.apply(flood);
  const double total = std::accumulate(made.magnitude.begin(), made.magnitude.end(), 0.0);
  for (int level = 0; level < made.tensor.camera_tree().levels(); ++level) {
    const TransportTensor stopped = *made.tensor.stopped_at(level);
    const auto image = stopped.apply(flood);
    for (std::size_t i = 0; i < exact->values().size(); ++i)
      EXPECT_NEAR(image->values()[i], exact->values()[i],
                  kStored * double{exact->values()[i]} + 1000 * kEpsilon * total)  // stored once more
          << "level " << level;
    for (const Leaf& leaf : stopped.leaves()) EXPECT_LE(leaf.level, level);
  }
}

TEST(TransportTensor, stopped_at_the_last_level_is_the_tensor) {
  const auto made = RandomTensor({8, 8}, {}, true, 1, 3).make(2, 1, 50);
  const Image<float> pattern = natural_pattern(Grid{8, 8}, 1);
  EXPECT_EQ(*made.tensor.stopped_at(made.tensor.camera_tree().levels() - 1)->apply(pattern),
            *made.tensor.apply(pattern));
}

TEST(TransportTensor, slice_shows_the_matrix_between_the_pixels_of_a_row) {
  // One scalar at most per entry and leaves of one level: nothing overlaps, so a slice is the matrix itself.
  const Grid grid{6, 7};
  const auto made = RandomTensor(grid, {}, true, 1, 33).make(2, 2, 0);
  const BlockTree& tree = made.tensor.camera_tree();
  std::vector<std::size_t> tree_index(42);
  for (std::size_t t = 0; t < 42; ++t) tree_index[tree.order()[t]] = t;
  const int row = 3;
  const auto index = [&](int col) {
    const int raster = row * grid.cols + col;
    return tree_index[raster];
  };
  const auto slice = made.tensor.slice(row, 0);
  const auto levels = made.tensor.level_map(row);
  ASSERT_TRUE(slice.ok() && levels.ok());
  for (int x = 0; x < grid.cols; ++x) {
    for (int u = 0; u < grid.cols; ++u) {
      const std::size_t at = index(x) * made.cols + index(u);
      EXPECT_NEAR(slice->at(x, u), made.matrix[at], (kStored + 8 * kEpsilon) * made.magnitude[at]);
      EXPECT_EQ(levels->at(x, u), made.magnitude[at] > 0 ? 2.0F : -1.0F);
    }
  }
  EXPECT_FALSE(made.tensor.slice(6, 0).ok());
}

TEST(TransportTensor, leaves_are_counted_by_level_and_kind) {
  TensorBuilder builder(BlockTree(Grid{2, 2}), 1);
  builder.add_empty(0, 0, 0);
  builder.add_leaf(2, 4, 0, 2, 1, 1, std::vector<float>{1, 2, 3, 4});
  builder.add_leaf(2, 4, 2, 4, 2, 1, std::vector<float>{1, 2, 3, 4, 1, 2, 3, 4});
  builder.add_scalar(0, 0, std::vector<float>{1});
  const auto counts = std::move(builder).finish().leaves_per_level();
  ASSERT_EQ(counts.size(), 2U);
  EXPECT_EQ(counts[0].empty, 1);
  EXPECT_EQ(counts[1].rank1, 1);
  EXPECT_EQ(counts[1].low_rank, 1);
  EXPECT_EQ(counts[1].scalar, 1);
}

}  // namespace

}  // namespace symrig::transport_tensor_test

namespace symrig::stopped_test {
namespace {

/// T = identity, and 1/8 between all pixels of two blocks of level 1, stored by single entries.
TransportTensor fine(const BlockTree& tree) {
  TensorBuilder builder(tree, 1);
  const std::array<float, 1> one{1}, eighth{0.125F};
  for (std::int32_t i = 0; i < tree.grid().size(); ++i) builder.add_scalar(i, i, one);
  for (std::int32_t i = tree.level(1)[1].begin; i < tree.level(1)[1].end; ++i)
    for (std::int32_t j = tree.level(1)[0].begin; j < tree.level(1)[0].end; ++j)
      builder.add_scalar(i, j, eighth);
  return std::move(builder).finish();
}

Image<float> lit(Grid grid, int row, int col) {
  Image<float> light(grid);
  light.at(row, col) = 1;
  return light;
}

// A capture takes the light inside a block for direct light: cut at level 0, a lit pixel keeps all the light
// of its row.
TEST(StoppedCapture, a_block_with_itself_becomes_direct_light) {
  const BlockTree tree({4, 4});
  const TransportTensor stopped = *stopped_capture(fine(tree), 0, WithinBlocks::direct);
  const auto seen = stopped.apply(lit({4, 4}, 0, 0));
  EXPECT_FLOAT_EQ(seen->at(0, 0), 1.5F);  // 1, and four entries of 1/8
  EXPECT_EQ(seen->at(0, 3), 0);
  const auto spread = stopped_capture(fine(tree), 0, WithinBlocks::product)->apply(lit({4, 4}, 0, 0));
  EXPECT_GT(spread->at(3, 3), 0);
}

// Two blocks that see each other evenly are their own product: nothing is lost at their level.
TEST(StoppedCapture, a_pair_becomes_the_product_of_its_sums) {
  const BlockTree tree({4, 4});
  const TransportTensor whole = fine(tree);
  const TransportTensor stopped = *stopped_capture(whole, 1, WithinBlocks::direct);
  const Image<float> light = lit({4, 4}, 1, 1);
  const auto exact = whole.apply(light), seen = stopped.apply(light);
  for (std::size_t i = 0; i < 16; ++i)
    EXPECT_NEAR(seen->values()[i], exact->values()[i], 1e-3) << i;  // 16-bit floats
}

/// Rank 2 between two whole blocks of level 1.
TransportTensor merged(const BlockTree& tree) {
  TensorBuilder builder(tree, 1);
  const Block& a = tree.level(1)[0];
  const Block& b = tree.level(1)[1];
  //                          A: two columns over b           B: two columns over a
  const std::vector<float> factors{1, 1, 0, 0, 0, 0, 1, 1, 1, 1, 0, 0, 0, 0, 1, 1};
  builder.add_leaf(b.begin, b.end, a.begin, a.end, 2, 1, factors);
  return std::move(builder).finish();
}

// A leaf of rank 2 was made in the end of leaves one level further down: a capture that stops above does not
// have it.
TEST(StoppedCapture, merged_leaves_count_as_cut_further) {
  const BlockTree tree({4, 4});
  const TransportTensor above = *stopped_capture(merged(tree), 1, WithinBlocks::direct);
  for (const Leaf& leaf : above.leaves()) EXPECT_EQ(leaf.rank, 1);
  int two = 0;
  const TransportTensor below = *stopped_capture(merged(tree), 2, WithinBlocks::direct);
  for (const Leaf& leaf : below.leaves()) two += leaf.rank == 2 ? 1 : 0;
  EXPECT_EQ(two, 1);
}

}  // namespace

}  // namespace symrig::stopped_test
