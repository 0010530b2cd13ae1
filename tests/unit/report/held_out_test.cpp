// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/summary.hpp"

#include <array>

#include <gtest/gtest.h>

namespace symrig::held_out_test {
namespace {

/// T = 2 on the diagonal of a 2 x 4 grid, except that the last camera pixel sees nothing.
TransportTensor seven_lit() {
  TensorBuilder builder(BlockTree({2, 4}), 1);
  const BlockTree tree({2, 4});
  const std::array<float, 1> two{2};
  for (std::int32_t i = 0; i < 8; ++i)
    if (tree.order()[i] != 7) builder.add_scalar(i, i, two);
  return std::move(builder).finish();
}

// By hand: the prediction of a pattern of ones is 2 on seven pixels. The photograph is off by 0.5 there and
// by 100 on the pixel that is not lit, which must not count.
TEST(HeldOutError, is_the_rms_over_lit_pixels) {
  HeldOut held_out{"name", Image<float>({2, 4}, 1, 1.0F), Image<float>({2, 4}, 1, 2.5F)};
  held_out.photograph.at(1, 3) = 100;
  const auto error = held_out_error(seven_lit(), held_out);
  ASSERT_TRUE(error.ok());
  EXPECT_EQ(error->name, "name");
  EXPECT_EQ(error->lit_pixels, 7);
  EXPECT_DOUBLE_EQ(error->rms, 0.5);
  EXPECT_DOUBLE_EQ(error->mean_white, 2);
  EXPECT_DOUBLE_EQ(error->relative(), 0.25);
}

TEST(HeldOutError, a_photograph_of_another_size_is_refused) {
  const auto error = held_out_error(seven_lit(), {"n", Image<float>({2, 4}), Image<float>({4, 2})});
  ASSERT_FALSE(error.ok());
  EXPECT_EQ(error.error().code, ErrorCode::size_mismatch);
}

TEST(HeldOutError, a_dark_scene_has_no_error_to_tell) {
  TensorBuilder builder(BlockTree({2, 2}), 1);
  const auto error =
      held_out_error(std::move(builder).finish(), {"n", Image<float>({2, 2}), Image<float>({2, 2}, 1, 1.0F)});
  ASSERT_TRUE(error.ok());
  EXPECT_EQ(error->lit_pixels, 0);
  EXPECT_EQ(error->relative(), 0);
}

}  // namespace
}  // namespace symrig::held_out_test
