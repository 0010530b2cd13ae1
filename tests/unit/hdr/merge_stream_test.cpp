// SPDX-License-Identifier: Apache-2.0
// Frames added one by one: against merge(), and against the Cramér-Rao bound.
#include "merge_contest.hpp"
#include "symrig/hdr/merge.hpp"

#include <gtest/gtest.h>

namespace symrig::merge_stream_test {
namespace {

using namespace std::chrono_literals;

const NoiseModel kSensor = NoiseModel::from_electrons({});
constexpr Grid kGrid{200, 250};
constexpr std::size_t kPixels = 50'000;

Result<Radiance> stream(const std::vector<Frame>& frames, const MergeOptions& options = {},
                        Grid grid = kGrid) {
  std::vector<Nanoseconds> exposures;
  exposures.reserve(frames.size());
  for (const Frame& frame : frames) exposures.push_back(frame.exposure);
  SYMRIG_TRY(MergeStream stream, MergeStream::begin(grid, 1, kSensor, exposures));
  for (const Frame& frame : frames) SYMRIG_CHECK(stream.add(frame));
  return stream.finish(options);
}

// Two different exposures: the line through both is exactly the best weight. Rounding: sums of ten floats.
TEST(MergeStream, TwoExposuresMergeAsMergeDoes) {
  test::Random random(3);
  for (const double electrons : {0.0, 30.0, 3000.0, 60'000.0}) {
    const auto bracket = test::photograph_uniform(kSensor, test::exposure_ladder(2, 16, 100ms),
                                                  electrons / 0.1, kPixels, random);
    const auto merged = merge(bracket.frames(), kGrid, 1, kSensor);
    const auto streamed = stream(bracket.frames());
    ASSERT_TRUE(merged.ok() && streamed.ok());
    for (std::size_t i = 0; i < kPixels; ++i) {
      const double sigma = std::sqrt(merged->variance.values()[i]);
      ASSERT_EQ(streamed->valid.values()[i], merged->valid.values()[i]);
      ASSERT_NEAR(streamed->mean.values()[i], merged->mean.values()[i], 1e-3 * sigma) << i;
      ASSERT_NEAR(streamed->variance.values()[i], merged->variance.values()[i], 1e-4 * sigma * sigma) << i;
    }
  }
}

struct Ladder {
  int count, ratio;
  double electrons;  // in the longest exposure
};
class Efficiency : public testing::TestWithParam<Ladder> {};

// √(2 / 50,000) = 0.6 % is the error of a variance from as many pixels: five of them.
TEST_P(Efficiency, IsNearTheCramerRaoBoundWithRightVarianceAndNoBias) {
  const Ladder ladder = GetParam();
  const auto exposures = test::exposure_ladder(ladder.count, ladder.ratio, 100ms);
  const double rate = ladder.electrons / 0.1;
  test::Random random(17);
  const auto bracket = test::photograph_uniform(kSensor, exposures, rate, kPixels, random);
  const auto merged = stream(bracket.frames());
  ASSERT_TRUE(merged.ok());
  double squares = 0, sum = 0, told = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    const double error = merged->mean.values()[i] - rate;
    squares += error * error / kPixels;
    sum += error / kPixels;
    told += merged->variance.values()[i] / kPixels;
  }
  EXPECT_GE(test::cramer_rao(kSensor, exposures, rate) / squares, 0.95 - 5 * 0.0063);
  EXPECT_NEAR(told / squares, 1, 0.05 + 5 * 0.0063);
  EXPECT_NEAR(sum / std::sqrt(squares), 0, 0.02 + 5 * 0.0045);
}
INSTANTIATE_TEST_SUITE_P(Ladders, Efficiency,
                         testing::Values(Ladder{4, 8, 0}, Ladder{4, 8, 50}, Ladder{4, 8, 5000},
                                         Ladder{4, 8, 100'000}, Ladder{6, 2, 20}, Ladder{6, 2, 300},
                                         Ladder{6, 2, 10'000}, Ladder{8, 2, 100}, Ladder{3, 4, 40},
                                         Ladder{3, 4, 1000}));

TEST(MergeStream, AHundredFramesAreWorthAHundred) {
  test::Random random(5);
  const std::vector<Nanoseconds> exposures(100, 10ms);
  const double rate = 200 / 0.01;
  const auto bracket = test::photograph_uniform(kSensor, exposures, rate, 5000, random);
  const auto merged = stream(bracket.frames(), {}, {50, 100});
  ASSERT_TRUE(merged.ok());
  double squares = 0;
  for (std::size_t i = 0; i < 5000; ++i) squares += std::pow(merged->mean.values()[i] - rate, 2) / 5000;
  EXPECT_NEAR(squares / test::cramer_rao(kSensor, exposures, rate), 1, 5 * std::sqrt(2.0 / 5000));
}

TEST(MergeStream, SaturatedAndDeadPixelsWeighNothing) {
  constexpr Grid kSmall{1, 3};
  const std::vector<std::uint16_t> longer{4095, 4095, 1000}, shorter{4095, 564, 564};
  Image<std::uint8_t> dead(kSmall);
  dead.at(0, 2) = 1;
  const auto merged = stream({{longer, 100ms}, {shorter, 10ms}}, {.dead = &dead}, kSmall);
  ASSERT_TRUE(merged.ok());
  EXPECT_EQ(merged->valid.values()[0], 0);
  EXPECT_EQ(merged->mean.values()[0], 0);
  EXPECT_EQ(merged->valid.values()[1], 1);
  EXPECT_NEAR(merged->mean.values()[1], 500 / kSensor.gain() / 0.01, 1e-3 * 500 / kSensor.gain() / 0.01);
  EXPECT_EQ(merged->valid.values()[2], 0);
}

TEST(MergeStream, RefusesWhatMergeRefuses) {
  EXPECT_EQ(MergeStream::begin(kGrid, 1, kSensor, {}).error().code, ErrorCode::bad_argument);
  const std::vector<Nanoseconds> none{0ns};
  EXPECT_EQ(MergeStream::begin(kGrid, 1, kSensor, none).error().code, ErrorCode::bad_argument);
  const std::vector<Nanoseconds> one{1ms};
  auto stream = MergeStream::begin(kGrid, 1, kSensor, one);
  ASSERT_TRUE(stream.ok());
  const std::vector<std::uint16_t> few(7);
  EXPECT_EQ(stream->add({few, 1ms}).error().code, ErrorCode::size_mismatch);
  EXPECT_EQ(stream->finish({.scale = -1}).error().code, ErrorCode::bad_argument);
}

}  // namespace

}  // namespace symrig::merge_stream_test

namespace symrig::weights_test {

// The merge against the weights of Debevec and Malik, and of Robertson, Borman and Stevenson, on the same
// frames.

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
