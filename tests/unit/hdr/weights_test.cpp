// SPDX-License-Identifier: Apache-2.0
// The merge against the weights of Debevec and Malik, and of Robertson, Borman and Stevenson, on the same
// frames.
#include "merge_contest.hpp"

#include <gtest/gtest.h>

namespace symrig::weights_test {
namespace {

using namespace std::chrono_literals;

const NoiseModel kSensor = NoiseModel::from_electrons({});
constexpr Grid kGrid{200, 250};
constexpr std::size_t kPixels = 50'000;

class Contest : public testing::TestWithParam<double> {};

// All are means of the same samples: where one frame says nearly all, they are equal up to the weights of the
// others. Without light t² is the best weight itself, and ours, which must learn that from noisy samples, may
// lose the 2 % that merge.hpp states.
TEST_P(Contest, MergeHasTheSmallestErrorAtEveryLevel) {
  const double rate = GetParam() / 0.1;
  test::Random random(23);
  const auto bracket =
      test::photograph_uniform(kSensor, test::exposure_ladder(4, 8, 100ms), rate, kPixels, random);
  const auto merged = merge(bracket.frames(), kGrid, 1, kSensor);
  ASSERT_TRUE(merged.ok());
  const double ours = test::mean_square_error(*merged, rate);
  const auto with = [&](const test::Weight& weight) {
    return test::mean_square_error(kSensor, bracket.frames(), rate, weight);
  };
  const double debevec = with(test::debevec_weight(kSensor)),
               robertson = with(test::robertson_weight(kSensor));
  RecordProperty("snr_gain_debevec_db", std::to_string(10 * std::log10(debevec / ours)));
  RecordProperty("snr_gain_robertson_db", std::to_string(10 * std::log10(robertson / ours)));
  EXPECT_LT(ours, debevec * (GetParam() == 0 ? 1.02 : 1.001));
  EXPECT_LT(ours, robertson * (GetParam() == 0 ? 1.02 : 1.001));
}
INSTANTIATE_TEST_SUITE_P(Levels, Contest,
                         testing::Values(0., 10., 100., 1'000., 10'000., 18'000., 30'000., 80'000., 145'000.,
                                         300'000., 1e6, 3e6, 9e6));

}  // namespace
}  // namespace symrig::weights_test
