// SPDX-License-Identifier: Apache-2.0
// A finished tensor against the floats it was built from: TensorBuilder::current() applies these one by one.
#include "symrig/base/statistics.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>

namespace symrig::packed_tensor_test {
namespace {

constexpr double kStored = 0x1p-10 * (1 + 0x1p-11);  // two factors, each within 2⁻¹¹
constexpr double kEpsilon = 0x1p-24;

Image<float> random_light(Grid grid, std::uint64_t seed) {
  Random random(seed);
  Image<float> light(grid);
  for (float& v : light.values()) v = static_cast<float>(random.uniform());
  return light;
}

/// A tensor with leaves of several levels, ranks and sizes, entries, a band and an ambient leaf over all of
/// it; all values positive, so that T p = Σ|A||B|ᵀ|p| is the magnitude that bounds need.
class Everything {
 public:
  Everything(Grid grid, int channels)
      : tree_(grid), channels_(static_cast<std::size_t>(channels)), builder_(tree_, channels) {
    for (int level = 0; level < tree_.levels(); ++level) add_level(level);
    add_ambient();
    add_band(1);
    add_band(2);
  }
  const TransportTensor& in_floats() const { return builder_.current(); }
  TransportTensor finish() { return std::move(builder_).finish(); }

 private:
  std::vector<float> values(std::int64_t n) {
    std::vector<float> v(static_cast<std::size_t>(n));
    for (float& x : v) x = static_cast<float>(random_.uniform());
    return v;
  }
  std::int32_t pixel() {
    return static_cast<std::int32_t>(random_.uniform() * static_cast<double>(tree_.grid().size()));
  }
  void add_level(int level) {
    const auto blocks = tree_.level(level);
    for (int k = 0; k < 40; ++k) {
      const auto pick = [&] {
        return blocks[static_cast<std::size_t>(random_.uniform() * static_cast<double>(blocks.size()))];
      };
      const Block i = pick(), j = pick();
      if (i.begin == j.begin) continue;
      const int rank = std::min({1 + k % 5, i.size(), j.size()});
      builder_.add_leaf(i.begin, i.end, j.begin, j.end, rank, level,
                        values(std::int64_t{rank} * (i.size() + j.size()) * std::ssize(channel_list())));
      builder_.add_scalar(pixel(), pixel(), values(std::ssize(channel_list())));
    }
  }
  void add_ambient() {
    std::vector<float> factors;
    for (std::size_t c = 0; c < channels_; ++c) {
      const auto a = values(2 * tree_.grid().size());
      factors.insert(factors.end(), a.begin(), a.end());
      factors.insert(factors.end(), a.begin(), a.end());
    }
    const auto all = static_cast<std::int32_t>(tree_.grid().size());
    builder_.add_leaf(0, all, 0, all, 2, 0, factors);
  }
  void add_band(int radius) {
    const Grid grid = tree_.grid();
    std::vector<float> planes;
    for (std::size_t c = 0; c < channels_; ++c)
      for (const auto& [dy, dx] : band_offsets(radius))
        for (int row = 0; row < grid.rows; ++row)
          for (int col = 0; col < grid.cols; ++col)
            planes.push_back(row + dy < grid.rows && col + dx >= 0 && col + dx < grid.cols
                                 ? static_cast<float>(random_.uniform())
                                 : 0.0F);
    builder_.add_band(radius, planes);
  }
  std::vector<char> channel_list() const { return std::vector<char>(channels_); }

  Random random_{17};
  BlockTree tree_;
  std::size_t channels_;
  TensorBuilder builder_;
};

class AnySize : public testing::TestWithParam<Grid> {};
// Below, at and above one chunk of pixels and one vector; more than one chunk on both sides of a column.
INSTANTIATE_TEST_SUITE_P(Sizes, AnySize,
                         testing::Values(Grid{1, 1}, Grid{1, 19}, Grid{5, 3}, Grid{33, 31}, Grid{64, 64},
                                         Grid{97, 131}),
                         [](const auto& grid) {
                           return "rows" + std::to_string(grid.param.rows) + "cols" +
                                  std::to_string(grid.param.cols);
                         });

// Storing moves an entry by at most kStored of Σ|A||B|ᵀ; both sides add up to (pixels + all leaves) rounded
// terms. Everything is positive, so the photograph itself is the sum of magnitudes.
TEST_P(AnySize, packing_keeps_the_stated_error) {
  Everything everything(GetParam(), 2);
  const Image<float> light = random_light(GetParam(), 5);
  const auto in_floats = everything.in_floats().apply(light);
  const TransportTensor tensor = everything.finish();
  const auto packed = tensor.apply(light);
  ASSERT_TRUE(in_floats.ok() && packed.ok());
  const double terms =
      static_cast<double>(GetParam().size()) + 5 * static_cast<double>(tensor.leaves().size());
  for (std::size_t i = 0; i < packed->values().size(); ++i) {
    const double exact = in_floats->values()[i];
    EXPECT_NEAR(packed->values()[i], exact, (kStored + 2 * terms * kEpsilon) * exact) << i;
  }
}

TEST_P(AnySize, any_number_of_threads_gives_the_same_bits) {
  const TransportTensor tensor = Everything(GetParam(), 2).finish();
  const Image<float> light = random_light(GetParam(), 6);
  std::vector<Image<float>> batch;
  for (std::uint64_t k = 0; k < 19; ++k) batch.push_back(random_light(GetParam(), 30 + k));
  Image<float> first;
  std::vector<Image<float>> first_batch;
  for (const std::size_t threads : {1, 2, 3, 4}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    const auto photograph = tensor.apply(light);
    const auto photographs = tensor.apply_batch(batch);
    ASSERT_TRUE(photograph.ok() && photographs.ok());
    if (threads == 1) {
      first = *photograph;
      first_batch = *photographs;
    }
    EXPECT_EQ(*photograph, first) << threads << " threads";
    EXPECT_EQ(*photographs, first_batch) << threads << " threads";
  }
}

// The same stored numbers, summed in another order: twice the bound on float sums.
TEST_P(AnySize, a_batch_equals_its_patterns_one_by_one) {
  const TransportTensor tensor = Everything(GetParam(), 2).finish();
  const double terms =
      static_cast<double>(GetParam().size()) + 5 * static_cast<double>(tensor.leaves().size());
  for (const std::size_t count : {std::size_t{1}, std::size_t{16}, std::size_t{21}}) {
    std::vector<Image<float>> batch;
    for (std::uint64_t k = 0; k < count; ++k) batch.push_back(random_light(GetParam(), k + 1));
    const auto photographs = tensor.apply_batch(batch);
    ASSERT_TRUE(photographs.ok());
    ASSERT_EQ(photographs->size(), count);
    for (std::size_t k = 0; k < count; ++k) {
      const auto one = tensor.apply(batch[k]);
      for (std::size_t i = 0; i < one->values().size(); ++i)
        EXPECT_NEAR((*photographs)[k].values()[i], one->values()[i],
                    2 * terms * kEpsilon * double{one->values()[i]});
    }
  }
}

/// Restricts the kernels to one instruction set while it lives.
class OnlyTarget {
 public:
  explicit OnlyTarget(std::int64_t target) { choose(target); }
  ~OnlyTarget() { choose(0); }
  OnlyTarget(const OnlyTarget&) = delete;
  OnlyTarget& operator=(const OnlyTarget&) = delete;

 private:
  static void choose(std::int64_t target) {
    hwy::SetSupportedTargetsForTest(target);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

// With and without instructions for halves and for fused multiply-add: other roundings, the same numbers.
TEST_P(AnySize, every_instruction_set_gives_the_same_photograph) {
  const TransportTensor tensor = Everything(GetParam(), 1).finish();
  const std::vector<Image<float>> lights{random_light(GetParam(), 8), random_light(GetParam(), 9)};
  const Image<float> best = *tensor.apply(lights[0]);
  const double terms =
      static_cast<double>(GetParam().size()) + 5 * static_cast<double>(tensor.leaves().size());
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    const OnlyTarget target(left & -left);
    const Image<float> one = *tensor.apply(lights[0]);
    const Image<float> of_batch = (*tensor.apply_batch(lights))[0];
    for (std::size_t i = 0; i < best.values().size(); ++i) {
      const double bound = 4 * terms * kEpsilon * double{best.values()[i]};
      EXPECT_NEAR(one.values()[i], best.values()[i], bound) << hwy::TargetName(left & -left);
      EXPECT_NEAR(of_batch.values()[i], best.values()[i], bound) << hwy::TargetName(left & -left);
    }
  }
}

TEST(PackedTensor, a_growing_tensor_takes_batches_too) {
  Everything everything({5, 6}, 2);
  const std::vector<Image<float>> lights{random_light({5, 6}, 1), random_light({5, 6}, 2)};
  const auto photographs = everything.in_floats().apply_batch(lights);
  ASSERT_TRUE(photographs.ok());
  EXPECT_EQ((*photographs)[1], *everything.in_floats().apply(lights[1]));
}

TEST(PackedTensor, an_empty_batch_is_empty_and_a_wrong_pattern_is_refused) {
  const TransportTensor tensor = Everything({5, 6}, 1).finish();
  EXPECT_TRUE(tensor.apply_batch({})->empty());
  const std::vector<Image<float>> batch{Image<float>(Grid{5, 6}), Image<float>(Grid{6, 5})};
  EXPECT_EQ(tensor.apply_batch(batch).error().code, ErrorCode::size_mismatch);
}

// One lit pixel: dark chunks and dark groups of columns are skipped, the answer is a column of T all the
// same.
TEST(PackedTensor, dark_patterns_are_skipped_without_a_trace) {
  const Grid grid{97, 131};
  Everything everything(grid, 1);
  Image<float> light(grid);
  light.at(60, 7) = 1;
  const auto exact = everything.in_floats().apply(light);
  const TransportTensor tensor = everything.finish();
  const auto packed = tensor.apply(light);
  for (std::size_t i = 0; i < packed->values().size(); ++i)  // 400 leaves at most, each rounded a few times
    EXPECT_NEAR(packed->values()[i], exact->values()[i],
                (kStored + 2000 * kEpsilon) * double{exact->values()[i]});
  const auto dark = tensor.apply(Image<float>(grid));
  for (const float v : dark->values()) EXPECT_EQ(v, 0.0F);
}

TEST(PackedTensor, a_band_adds_to_what_is_there) {
  const Grid grid{3, 4};
  const BlockTree tree(grid);
  TensorBuilder builder(tree, 1);
  const auto index = [&](int row, int col) {
    const auto at = std::find(tree.order().begin(), tree.order().end(), row * grid.cols + col);
    return static_cast<std::int32_t>(at - tree.order().begin());
  };
  builder.add_scalar(index(1, 1), index(1, 2), std::vector<float>{4});
  std::vector<float> planes(std::size_t{4} * 12);  // offsets (0, 1), (1, −1), (1, 0), (1, 1)
  planes[0 * 12 + 5] = 2;                          // (1, 1) ↔ (1, 2)
  planes[1 * 12 + 5] = 8;                          // (1, 1) ↔ (2, 0)
  builder.add_band(1, planes);
  const TransportTensor tensor = std::move(builder).finish();
  Image<float> light(grid);
  light.at(1, 1) = 1;
  Image<float> expected(grid);
  expected.at(1, 2) = 6;
  expected.at(2, 0) = 8;
  EXPECT_EQ(*tensor.apply(light), expected);
  EXPECT_EQ(*tensor.apply_transposed(light), expected);
  EXPECT_EQ(tensor.slice(1, 0)->at(1, 2), 6.0F);
  EXPECT_EQ(tensor.slice(1, 0)->at(2, 1), 6.0F);
  EXPECT_EQ(tensor.level_map(1)->at(1, 2), static_cast<float>(tree.levels() - 1));
  // Stopped above the pixels, the light stays: 2 + 4 one way, 8 the other, and back.
  const Image<float> flood(grid, 1, 1.0F);
  for (int level = 0; level < tree.levels(); ++level) {
    double sum = 0;
    const auto photograph = tensor.stopped_at(level)->apply(flood);
    for (const float v : photograph->values()) sum += double{v};
    EXPECT_NEAR(sum, 28.0, 28 * (kStored + 40 * kEpsilon)) << "level " << level;
  }
}

// b = ±a is stored once: T_II = a aᵀ − c cᵀ, which a pair (c, −c) says.
TEST(PackedTensor, symmetric_leaves_on_the_diagonal_are_stored_once) {
  const std::vector<float> factors{1, 2, 3, 4, 5, 6, 1,  1,  1,  2,  2,  2,
                                   1, 2, 3, 4, 5, 6, -1, -1, -1, -2, -2, -2};
  const auto build = [&](bool symmetric_pair) {
    TensorBuilder builder(BlockTree(Grid{2, 3}), 1);
    std::vector<float> f = factors;
    if (!symmetric_pair) f[12] = 1.5F;
    builder.add_leaf(0, 6, 0, 6, 2, 0, f);
    return std::move(builder).finish();
  };
  std::vector<float> p{1, 0, 0, 0, 0, 1}, y(6), expected(6);
  build(true).apply_tree(p, y, 0, false);
  const float a[] = {1, 2, 3, 4, 5, 6}, c[] = {1, 1, 1, 2, 2, 2};
  for (std::size_t i = 0; i < 6; ++i) expected[i] = a[i] * 7 - c[i] * 3;
  EXPECT_EQ(y, expected);  // small whole numbers: exact in halves and floats
  EXPECT_EQ(build(false).bytes() - build(true).bytes(), 6 * 2 + 4) << "six halves and a piece";
  const auto kept = *build(true).factors();
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j)
      EXPECT_EQ(kept[i] * kept[12 + j] + kept[6 + i] * kept[18 + j], a[i] * a[j] - c[i] * c[j]);
}

TEST(PackedTensor, a_stored_zero_on_the_diagonal_is_known_and_not_absent) {
  TensorBuilder builder(BlockTree(Grid{2, 2}), 1);
  builder.add_scalar(2, 2, std::vector<float>{0});
  builder.add_scalar(3, 1, std::vector<float>{0.25});
  const TransportTensor tensor = std::move(builder).finish();
  EXPECT_EQ(tensor.scalar_count(), 2);
  EXPECT_EQ(tensor.leaves_per_level().back().scalar, 2);
  ASSERT_EQ(tensor.scalars().size(), 2U);
  EXPECT_EQ(tensor.scalars()[0].row, 2);
  EXPECT_EQ(tensor.scalars()[1].row, 3);
  EXPECT_EQ(tensor.scalar_values(), (std::vector<float>{0, 0.25}));
}

TEST(PackedTensor, empty_leaves_come_back_sorted) {
  TensorBuilder builder(BlockTree(Grid{64, 64}), 1);
  builder.add_empty(5, 1023, 1023);
  builder.add_empty(5, 1, 700);
  builder.add_empty(5, 0, 0);
  const TransportTensor tensor = std::move(builder).finish();
  EXPECT_EQ(tensor.empty_count(5), 3);
  const auto empties = tensor.empties(5);
  ASSERT_EQ(empties.size(), 3U);
  EXPECT_EQ(empties[0].col_block, 0);
  EXPECT_EQ(empties[1].row_block, 1);
  EXPECT_EQ(empties[1].col_block, 700);
  EXPECT_EQ(empties[2].row_block, 1023);
  EXPECT_EQ(empties[2].col_block, 1023);
}

// Factors of any size: 1e-30 · 1e30 is 1, whatever halves hold.
TEST(PackedTensor, tiny_times_huge_is_neither_lost_nor_infinite) {
  TensorBuilder builder(BlockTree(Grid{1, 2}), 1);
  builder.add_leaf(1, 2, 0, 1, 1, 1, std::vector<float>{1e-30F, 1e30F});
  std::vector<float> p{1, 1}, y(2);
  std::move(builder).finish().apply_tree(p, y, 0, false);
  EXPECT_NEAR(y[0], 1.0, kStored + 4 * kEpsilon);
  EXPECT_NEAR(y[1], 1.0, kStored + 4 * kEpsilon);
}

}  // namespace
}  // namespace symrig::packed_tensor_test
