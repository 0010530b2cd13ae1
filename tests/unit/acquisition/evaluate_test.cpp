// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/evaluate.hpp"

#include "dense_scene.hpp"

#include <gtest/gtest.h>

namespace symrig::evaluate_test {
namespace {

/// The matrix scaled by `gain`, entry by entry as scalars.
TransportTensor as_tensor(const tests::DenseTransport& t, double gain) {
  const BlockTree tree(t.grid());
  TensorBuilder builder(tree, 1);
  for (std::int32_t i = 0; i < t.grid().size(); ++i)
    for (std::int32_t j = 0; j <= i; ++j) {
      const auto v = static_cast<float>(gain * t.at(tree.order()[i], tree.order()[j]));
      builder.add_scalar(i, j, std::span(&v, 1));
    }
  return std::move(builder).finish();
}

TEST(Evaluate, a_tensor_that_is_too_bright_by_a_tenth_errs_by_a_tenth_in_every_way) {
  const auto scene = tests::facing_planes(Grid{12, 14});
  const auto e = evaluate(as_tensor(scene, 1.1), scene.truth());
  ASSERT_TRUE(e.ok());
  for (const double error : {e->frobenius, e->indirect, e->flood, e->relight_bar, e->relight_random,
                             e->relight_natural, e->bar_indirect})
    EXPECT_NEAR(error, 0.1,
                168 * 0x1p-24 * 40);  // float sums over 168 pixels; signed probes cancel, hence the factor
}

TEST(Evaluate, the_exact_tensor_has_only_rounding) {
  const auto scene = tests::facing_planes(Grid{12, 14});
  const auto e = evaluate(as_tensor(scene, 1), scene.truth());
  for (const double error : {e->frobenius, e->indirect, e->flood, e->relight_bar, e->relight_random,
                             e->relight_natural, e->bar_indirect})
    EXPECT_LE(error, 0x1p-11 + 168 * 0x1p-24);  // entries off the diagonal are stored as halves
}

TEST(Evaluate, indirect_sees_what_frobenius_hides) {
  // Only the direct light is stored: the Frobenius error is small because the indirect light is, the indirect
  // error is everything.
  const auto scene = tests::facing_planes(Grid{12, 14}, 0.002);
  const BlockTree tree(scene.grid());
  TensorBuilder builder(tree, 1);
  for (std::int32_t i = 0; i < scene.grid().size(); ++i) {
    const int raster = tree.order()[i];
    const auto v = static_cast<float>(scene.at(raster, raster));
    builder.add_scalar(i, i, std::span(&v, 1));
  }
  const auto e = evaluate(std::move(builder).finish(), scene.truth());
  EXPECT_LT(e->frobenius, 0.02);
  EXPECT_NEAR(e->indirect, 1, 1e-6);
  EXPECT_NEAR(e->bar_indirect, 1, 1e-6);
}

TEST(Evaluate, another_grid_is_refused) {
  const auto scene = tests::facing_planes(Grid{6, 6});
  const auto other = tests::facing_planes(Grid{6, 7});
  const auto e = evaluate(as_tensor(scene, 1), [&](const Image<float>&) -> Result<Image<float>> {
    return other.apply(Image<float>(Grid{6, 7}));
  });
  ASSERT_FALSE(e.ok());
  EXPECT_EQ(e.error().code, ErrorCode::size_mismatch);
}

TEST(TestPatterns, are_the_same_everywhere_and_inside_their_range) {
  for (const Grid grid : {Grid{1, 1}, Grid{1, 9}, Grid{33, 20}}) {
    for (const auto& p : {bar_pattern(grid), natural_pattern(grid, 3), random_pattern(grid, 3)})
      for (const float v : p.values()) EXPECT_TRUE(v >= 0 && v <= 1);
    EXPECT_EQ(natural_pattern(grid, 3), natural_pattern(grid, 3));
  }
  EXPECT_NE(random_pattern(Grid{8, 8}, 3), random_pattern(Grid{8, 8}, 4));
}

}  // namespace
}  // namespace symrig::evaluate_test
