// SPDX-License-Identifier: Apache-2.0
// A dealt tensor against the whole one. mpirun runs these with one to four ranks.
#include "assert_ok.hpp"
#include "dealt_transport.hpp"
#include "scratch.hpp"
#include "symrig/base/statistics.hpp"
#include "unit/tensor/random_tensor.hpp"

#include <cmath>
#include <memory>
#include <numeric>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::dealt_test {
namespace {

using mpi::DealtTransport;
using mpi::Ranks;

constexpr double kEpsilon = 0x1p-24;

Image<float> random_picture(Grid grid, int channels, std::uint64_t seed) {
  Random random(seed);
  Image<float> picture(grid, channels);
  for (float& v : picture.values()) v = static_cast<float>(random.uniform());
  return picture;
}

/// All values positive, so that T p is the Σ|A||B|ᵀ|p| that the bound needs.
struct Case {
  Grid camera, projector;
  bool symmetric;
  int channels;
  TransportTensor tensor;
  double roundings;  ///< (|J| + leaves on a pixel's path + ranks + 4), each of ε
};

Case make_case(Grid camera, Grid projector, bool symmetric, int channels) {
  auto made = tests::RandomTensor(camera, projector, symmetric, channels, 11, 0.0)
                  .with_band(symmetric)
                  .make(2, 3, 40);
  const double leaves = static_cast<double>(made.tensor.leaves().size()) * 3 + 40 + 4;
  const double longest = static_cast<double>(std::max(camera.size(), projector.size()));
  return {camera, projector, symmetric, channels, made.tensor, longest + leaves + Ranks::world().count() + 4};
}

/// Both sides round, each within the bound.
void expect_close(const Image<float>& dealt, const Image<float>& whole, double roundings) {
  ASSERT_EQ(dealt.grid(), whole.grid());
  ASSERT_EQ(dealt.channels(), whole.channels());
  for (std::size_t i = 0; i < whole.values().size(); ++i)
    ASSERT_LE(std::abs(static_cast<double>(dealt.values()[i]) - whole.values()[i]),
              2 * roundings * kEpsilon * whole.values()[i])
        << i;
}

class Dealt : public testing::TestWithParam<int> {
 protected:
  Dealt()
      : one_(GetParam() == 0   ? make_case({13, 10}, {13, 10}, true, 1)
             : GetParam() == 1 ? make_case({9, 12}, {9, 12}, true, 3)
                               : make_case({7, 15}, {10, 6}, false, 2)) {}

  Result<std::shared_ptr<const DealtTransport>> open() const {
    const auto path = scratch_ / "scene.h5";
    StoredScene scene;
    scene.tensor = one_.tensor;
    SYMRIG_CHECK(save_scene(path, scene));
    return DealtTransport::open(Ranks::world(), path);
  }

  test::Scratch scratch_;
  Case one_;
};

INSTANTIATE_TEST_SUITE_P(Tensors, Dealt, testing::Values(0, 1, 2));

TEST_P(Dealt, photographs_differ_by_the_stated_rounding) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const Image<float> light = random_picture(one_.projector, 1, 1);
  const auto seen = (*dealt)->apply(light), whole = one_.tensor.apply(light);
  ASSERT_OK(seen);
  expect_close(*seen, *whole, one_.roundings);
}

TEST_P(Dealt, batches_of_any_size_do_too) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  for (const std::size_t count : {std::size_t{0}, std::size_t{2}, std::size_t{16}, std::size_t{19}}) {
    std::vector<Image<float>> lights;
    for (std::size_t k = 0; k < count; ++k) lights.push_back(random_picture(one_.projector, 1, k));
    const auto seen = (*dealt)->apply_batch(lights);
    ASSERT_OK(seen);
    ASSERT_EQ(seen->size(), count);
    for (std::size_t k = 0; k < count; ++k)
      expect_close((*seen)[k], *one_.tensor.apply(lights[k]), one_.roundings);
  }
}

TEST_P(Dealt, the_adjoint_does_too) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const Image<float> picture = random_picture(one_.camera, one_.channels, 2);
  const auto back = (*dealt)->adjoint(picture), whole = one_.tensor.adjoint(picture);
  ASSERT_OK(back);
  expect_close(*back, *whole, one_.roundings * one_.channels);
}

TEST_P(Dealt, shares_leave_nothing_out_and_hold_nothing_twice) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const auto mine = static_cast<double>((*dealt)->scene().tensor.leaves().size());
  if (Ranks::world().count() == 1) {
    EXPECT_EQ(mine, static_cast<double>(one_.tensor.leaves().size()));
  } else {
    EXPECT_LT(mine, static_cast<double>(one_.tensor.leaves().size()));
  }
}

TEST_P(Dealt, a_wrong_picture_is_refused_and_the_ranks_go_on) {
  const auto dealt = open();
  ASSERT_OK(dealt);
  const auto light = (*dealt)->apply(Image<float>(Grid{3, 3}));
  ASSERT_FALSE(light);
  EXPECT_EQ(light.error().code, ErrorCode::size_mismatch);
  const auto picture = (*dealt)->adjoint(Image<float>(one_.camera, one_.channels + 1));
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().code, ErrorCode::size_mismatch);
  EXPECT_TRUE((*dealt)->apply(Image<float>(one_.projector)));
}

TEST(DealtFile, a_missing_scene_is_refused_and_the_ranks_go_on) {
  const test::Scratch scratch;
  for (int round = 0; round < 2; ++round) {
    const auto dealt = DealtTransport::open(Ranks::world(), scratch / "none.h5");
    ASSERT_FALSE(dealt);
    EXPECT_EQ(dealt.error().code, ErrorCode::not_found);
  }
}

}  // namespace
}  // namespace symrig::dealt_test
