// SPDX-License-Identifier: Apache-2.0
#include "symrig/hdr/merge.hpp"

#include "merge_contest.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace symrig::merge_test {
namespace {

using test::Random;
using namespace std::chrono_literals;

const NoiseModel kSensor = NoiseModel::from_electrons({});

/// What many merged pixels of one radiance say about the merge.
struct Statistics {
  double chi_square = 0;     // mean of ((merged − truth) / σ)²; 1 when the variance is right
  double bias = 0;           // mean of merged − truth
  double mean_variance = 0;  // as told by the merge
  double variance = 0;       // mean of (merged − truth)²
  std::size_t valid = 0;

  double bias_in_sigmas() const { return bias / std::sqrt(variance); }
};

Statistics judge(const Radiance& merged, double truth) {
  Statistics s;
  for (std::size_t i = 0; i < merged.mean.values().size(); ++i) {
    if (!merged.valid.values()[i]) continue;
    const double error = merged.mean.values()[i] - truth;
    const double variance = merged.variance.values()[i];
    s.chi_square += error * error / variance;
    s.bias += error;
    s.mean_variance += variance;
    s.variance += error * error;
    ++s.valid;
  }
  const auto n = static_cast<double>(s.valid);
  return {s.chi_square / n, s.bias / n, s.mean_variance / n, s.variance / n, s.valid};
}

/// Variance [e⁻²] of the longest sample that does not saturate.
double longest_usable_variance(const NoiseModel& noise, const std::vector<Nanoseconds>& exposures,
                               double rate) {
  double variance = noise.floor_variance();
  for (const Nanoseconds t : exposures)
    if (test::usable(noise, rate * seconds(t)))
      variance = std::max(variance, noise.variance(rate * seconds(t)));
  return variance;
}

constexpr Grid kGrid{400, 500};
constexpr std::size_t kPixels = 200'000;
// Five sigmas of the mean of 2e5 squared (unit normal) and plain deviates.
constexpr double kChiSquareError = 5 * 0.00316;  // √(2 / 2e5)
constexpr double kBiasError = 5 * 0.00224;       // √(1 / 2e5)

Radiance merge_uniform(const std::vector<Nanoseconds>& exposures, double rate, std::uint64_t seed) {
  Random random(seed);
  const auto bracket = test::photograph_uniform(kSensor, exposures, rate, kPixels, random);
  auto merged = merge(bracket.frames(), kGrid, 1, kSensor);
  EXPECT_TRUE(merged.ok());
  return *std::move(merged);
}

/// Light levels: electrons in the longest exposure (0.1 s). The ladder's other frames collect 8, 64, 512
/// times less.
class MergeStatistics : public testing::TestWithParam<double> {};

TEST_P(MergeStatistics, VarianceIsRightBiasIsSmallAndTheCramerRaoBoundIsNear) {
  const auto exposures = test::exposure_ladder(4, 8, 100ms);
  const double rate = GetParam() / 0.1;
  const Statistics s = judge(merge_uniform(exposures, rate, 11), rate);
  const double efficiency = test::cramer_rao(kSensor, exposures, rate) / s.variance;
  RecordProperty("chi_square", std::to_string(s.chi_square));
  RecordProperty("bias_in_sigmas", std::to_string(s.bias_in_sigmas()));
  RecordProperty("variance_ratio", std::to_string(s.mean_variance / s.variance));
  RecordProperty("efficiency", std::to_string(efficiency));
  ASSERT_EQ(s.valid, kPixels);
  EXPECT_NEAR(s.bias_in_sigmas(), 0, 0.02 + kBiasError);
  EXPECT_NEAR(s.mean_variance / s.variance, 1, 0.02 + kChiSquareError);
  // σ² is estimated from the same noise n, so E[n² / (V + n)] ≈ 1 + (3 − skewness) / V: at most 3 / V, and a
  // quarter more for the higher orders.
  const double v = longest_usable_variance(kSensor, exposures, rate);
  EXPECT_NEAR(s.chi_square, 1, 3.75 / v + 0.01 + kChiSquareError);
  // The weights are the optimal ones but for the noise of the shared estimate (second order): 2 % at most.
  EXPECT_GE(efficiency, 0.98 - kChiSquareError);
}
INSTANTIATE_TEST_SUITE_P(Levels, MergeStatistics,
                         testing::Values(0., 1., 5., 30., 100., 1'000., 10'000., 19'000., 30'000., 145'000.,
                                         1e6, 9e6));

TEST(Merge, BiasAtSaturationIsBelowTheTruncationBound) {
  // A sample at saturation is kept only when it fell low: E[x | kept] − μ ≥ −σ φ(0)/Φ(0) = −0.8 σ, kept half
  // of the time. The merged mean is therefore low by at most φ(0) = 0.4 of that sample's σ.
  const auto exposures = test::exposure_ladder(4, 8, 100ms);
  const double electrons = (kSensor.saturation_code() - kSensor.pedestal()) / kSensor.gain();
  const Radiance merged = merge_uniform(exposures, electrons / 0.1, 5);
  double bias = 0;
  for (const float m : merged.mean.values()) bias += m - electrons / 0.1;
  bias /= static_cast<double>(kPixels);
  const double sigma = std::sqrt(kSensor.variance(electrons)) / 0.1;
  EXPECT_LT(std::abs(bias), 0.4 * sigma);
  EXPECT_LT(bias, -0.1 * sigma);  // the effect is there; if it is not, this test looks at the wrong level
}

TEST(Merge, NoSaturatedSampleLeaksIn) {
  // Far above the long frame's range its samples sit at the full well; a weight above 0 would pull the mean
  // down by thousands of σ.
  const auto exposures = test::exposure_ladder(2, 8, 100ms);
  const double rate = 100'000 / 0.1;
  EXPECT_NEAR(judge(merge_uniform(exposures, rate, 3), rate).bias_in_sigmas(), 0, 0.02 + kBiasError);
}

TEST(Merge, EqualFramesAverage) {
  // n equal frames: variance falls as 1/n, for every count that a bracket may have.
  const double rate = 5'000;
  for (int n = 1; n <= kMaxFrames; ++n) {
    const std::vector<Nanoseconds> exposures(n, 100ms);
    const Statistics s = judge(merge_uniform(exposures, rate, 17), rate);
    EXPECT_NEAR(s.chi_square, 1, 0.03 + kChiSquareError) << n << " frames";
    EXPECT_NEAR(s.mean_variance * n / (kSensor.variance(500) * 100), 1, 0.01) << n << " frames";
  }
}

TEST(Merge, HandComputedPixel) {
  // gain 1 DN/e⁻ (from the line), read² + 1/12 = 4 e⁻², pedestal 10. Codes 110 in 2 s and 60 in 1 s: rate =
  // 150 e⁻ / 3 s = 50 e⁻/s; weights 2² / (100 + 4), 1² / (50 + 4); both samples say 50 e⁻/s.
  const NoiseModel noise =
      NoiseModel::from_variance_line({.offset = 4, .slope = 1, .bits = 8, .pedestal = 10});
  const std::vector<std::uint16_t> longer{110}, shorter{60};
  const std::vector<Frame> frames{{longer, 2s}, {shorter, 1s}};
  const auto merged = merge(frames, {1, 1}, 1, noise, {.scale = 0.5});
  ASSERT_TRUE(merged.ok());
  EXPECT_NEAR(merged->mean.at(0, 0), 25, 25 * 1e-6);
  EXPECT_NEAR(merged->variance.at(0, 0), 0.25 / (4.0 / 104 + 1.0 / 54), 1e-5);
  EXPECT_EQ(merged->valid.at(0, 0), 1);
}

TEST(Merge, AllSaturatedIsInvalid) {
  const auto code = static_cast<std::uint16_t>(kSensor.saturation_code());
  const std::vector<std::uint16_t> full{code, static_cast<std::uint16_t>(code - 1), 65'535};
  const std::vector<Frame> frames{{full, 10ms}, {full, 10ms}};
  const auto merged = merge(frames, {1, 3}, 1, kSensor);
  ASSERT_TRUE(merged.ok());
  EXPECT_EQ(std::vector<std::uint8_t>(merged->valid.values().begin(), merged->valid.values().end()),
            (std::vector<std::uint8_t>{0, 1, 0}));
  EXPECT_EQ(merged->mean.at(0, 0), 0);
  EXPECT_EQ(merged->variance.at(0, 2), 0);
}

TEST(Merge, BlackIsSubtractedSignedWithItsVariance) {
  const std::vector<std::uint16_t> raw{100, 100, 100};
  const std::vector<Frame> frames{{raw, 100ms}};
  const auto plain = merge(frames, {1, 3}, 1, kSensor);
  ASSERT_TRUE(plain.ok());
  Radiance black{Image<float>({1, 3}, 1, 1e5F), Image<float>({1, 3}, 1, 7.0F),
                 Image<std::uint8_t>({1, 3}, 1, 1)};
  black.valid.at(0, 1) = 0;
  const auto merged = merge(frames, {1, 3}, 1, kSensor, {.black = &black});
  ASSERT_TRUE(merged.ok());
  EXPECT_EQ(merged->mean.at(0, 0), plain->mean.at(0, 0) - 1e5F);
  EXPECT_LT(merged->mean.at(0, 0), 0);
  EXPECT_EQ(merged->variance.at(0, 0), plain->variance.at(0, 0) + 7.0F);
  EXPECT_EQ(merged->valid.at(0, 1), 0);
  EXPECT_EQ(merged->mean.at(0, 1), 0);
  EXPECT_EQ(merged->valid.at(0, 2), 1);
}

TEST(Merge, DeadPixelsAreInvalidInEveryChannel) {
  const std::vector<std::uint16_t> raw(8, 200);
  const std::vector<Frame> frames{{raw, 1ms}};
  Image<std::uint8_t> dead({2, 2});
  dead.at(1, 0) = 1;
  const auto merged = merge(frames, {2, 2}, 2, kSensor, {.dead = &dead});
  ASSERT_TRUE(merged.ok());
  for (int c = 0; c < 2; ++c) {
    EXPECT_EQ(merged->valid.at(1, 0, c), 0);
    EXPECT_EQ(merged->mean.at(1, 0, c), 0);
    EXPECT_EQ(merged->valid.at(0, 0, c), 1);
  }
}

TEST(Merge, BitEqualForAnySplitAndAnyNumberOfThreads) {
  // 97 × 1031 pixels: several tasks and a tail of every length below the vector width.
  const Grid grid{97, 1031};
  const std::size_t pixels = grid.size();
  Random random(23);
  const auto exposures = test::exposure_ladder(3, 8, 100ms);
  const auto bracket = test::photograph_uniform(kSensor, exposures, 30'000, pixels, random);
  const auto whole = merge(bracket.frames(), grid, 1, kSensor);
  ASSERT_TRUE(whole.ok());
  {
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto serial = merge(bracket.frames(), grid, 1, kSensor);
    ASSERT_TRUE(serial.ok());
    EXPECT_EQ(whole->mean, serial->mean);
    EXPECT_EQ(whole->variance, serial->variance);
  }
  for (std::size_t begin = 0, length = 1; begin < pixels; begin += length, length = length % 37 + 1) {
    const std::size_t count = std::min(length, pixels - begin);
    auto frames = bracket.frames();
    for (Frame& frame : frames) frame.raw = frame.raw.subspan(begin, count);
    const auto part = merge(frames, {1, static_cast<int>(count)}, 1, kSensor);
    ASSERT_TRUE(part.ok());
    for (std::size_t i = 0; i < count; ++i) {
      ASSERT_EQ(part->mean.values()[i], whole->mean.values()[begin + i]) << begin + i;
      ASSERT_EQ(part->variance.values()[i], whole->variance.values()[begin + i]) << begin + i;
    }
  }
}

/// A photograph above the size from which results go past the cache, with black, dead and
/// saturated pixels, against the same photograph merged row by row, which stays below it.
TEST(Merge, BitEqualWhetherResultsAreStreamedOrNot) {
  const Grid grid{1'031, 997};  // prime: rows and planes start at every alignment
  const int channels = 2;       // 2 × 9.3 MB of results
  const std::size_t pixels = grid.size();
  Random random(31);
  const auto exposures = test::exposure_ladder(4, 8, 100ms);
  auto bracket = test::photograph_uniform(kSensor, exposures, 30'000, pixels * channels, random);
  for (auto& codes : bracket.codes)
    for (std::size_t i = 5; i < codes.size(); i += 1'009) codes[i] = 4'095;  // saturated in every frame
  Radiance black{Image<float>(grid, channels), Image<float>(grid, channels, 2.0F),
                 Image<std::uint8_t>(grid, channels, 1)};
  Image<std::uint8_t> dead(grid);
  for (std::size_t i = 0; i < pixels; ++i) {
    black.mean.values()[i] = static_cast<float>(i % 13);
    black.valid.values()[i + pixels] = i % 1'201 != 7;
    dead.values()[i] = i % 1'301 == 11;
  }
  const auto whole = merge(bracket.frames(), grid, channels, kSensor, {.black = &black, .dead = &dead});
  ASSERT_TRUE(whole.ok());
  const std::size_t cols = grid.cols;
  for (std::size_t row = 0; row < pixels * channels / cols; ++row) {
    const std::size_t at = row * cols, in_plane = at % pixels;
    auto frames = bracket.frames();
    for (Frame& frame : frames) frame.raw = frame.raw.subspan(at, cols);
    const Grid line{1, grid.cols};
    Radiance dark{Image<float>(line), Image<float>(line), Image<std::uint8_t>(line)};
    Image<std::uint8_t> blind(line);
    std::copy_n(black.mean.values().begin() + static_cast<std::ptrdiff_t>(at), cols,
                dark.mean.values().begin());
    std::copy_n(black.variance.values().begin() + static_cast<std::ptrdiff_t>(at), cols,
                dark.variance.values().begin());
    std::copy_n(black.valid.values().begin() + static_cast<std::ptrdiff_t>(at), cols,
                dark.valid.values().begin());
    std::copy_n(dead.values().begin() + static_cast<std::ptrdiff_t>(in_plane), cols, blind.values().begin());
    const auto part = merge(frames, line, 1, kSensor, {.black = &dark, .dead = &blind});
    ASSERT_TRUE(part.ok());
    for (std::size_t i = 0; i < cols; ++i) {
      ASSERT_EQ(part->mean.values()[i], whole->mean.values()[at + i]) << at + i;
      ASSERT_EQ(part->variance.values()[i], whole->variance.values()[at + i]) << at + i;
      ASSERT_EQ(part->valid.values()[i], whole->valid.values()[at + i]) << at + i;
    }
  }
}

TEST(Merge, ScaleAndExposureOfAnySizeKeepPrecision) {
  // The same light in units of 1e-20 and 1e+20, with 100 ns and 1,000 s exposures.
  const std::vector<std::uint16_t> raw{1'000};
  const double electrons = (1'000 - kSensor.pedestal()) / kSensor.gain();
  for (const Nanoseconds t : {Nanoseconds(100ns), Nanoseconds(1'000s)}) {
    for (const double scale : {1e-15, 1e15}) {
      const auto merged = merge(std::vector<Frame>{{raw, t}}, {1, 1}, 1, kSensor, {.scale = scale});
      ASSERT_TRUE(merged.ok());
      const double truth = scale * electrons / seconds(t);
      EXPECT_NEAR(merged->mean.at(0, 0) / truth, 1, 1e-6);  // eight float operations of 6e-8 each
    }
  }
}

struct BadCase {
  const char* name;
  ErrorCode code;
  std::size_t samples = 4;
  Nanoseconds exposure = 1ms;
  Grid grid{2, 2};
  double scale = 1;
  std::size_t frames = 1;
};

class MergeRefuses : public testing::TestWithParam<BadCase> {};

TEST_P(MergeRefuses, WithTheRightCode) {
  const BadCase& bad = GetParam();
  const std::vector<std::uint16_t> raw(bad.samples, 100);
  const std::vector<Frame> frames(bad.frames, Frame{raw, bad.exposure});
  const auto merged = merge(frames, bad.grid, 1, kSensor, {.scale = bad.scale});
  ASSERT_FALSE(merged.ok());
  EXPECT_EQ(merged.error().code, bad.code) << merged.error().line();
}
INSTANTIATE_TEST_SUITE_P(Input, MergeRefuses,
                         testing::Values(BadCase{"too_few_samples", ErrorCode::size_mismatch, 3},
                                         BadCase{"zero_exposure", ErrorCode::bad_argument, 4, 0ns},
                                         BadCase{"negative_exposure", ErrorCode::bad_argument, 4, -1ns},
                                         BadCase{"empty_grid", ErrorCode::bad_argument, 4, 1ms, {0, 2}},
                                         BadCase{"scale_not_a_number",
                                                 ErrorCode::bad_argument,
                                                 4,
                                                 1ms,
                                                 {2, 2},
                                                 std::numeric_limits<double>::quiet_NaN()},
                                         BadCase{"scale_zero", ErrorCode::bad_argument, 4, 1ms, {2, 2}, 0},
                                         BadCase{"no_frames", ErrorCode::bad_argument, 4, 1ms, {2, 2}, 1, 0},
                                         BadCase{
                                             "nine_frames", ErrorCode::bad_argument, 4, 1ms, {2, 2}, 1, 9}),
                         [](const auto& test) { return test.param.name; });

TEST(Merge, RefusesBlackThatIsNotANumberOrOfAnotherSize) {
  const std::vector<std::uint16_t> raw(4, 100);
  const std::vector<Frame> frames{{raw, 1ms}};
  Radiance black{Image<float>({2, 2}), Image<float>({2, 2}), Image<std::uint8_t>({2, 2}, 1, 1)};
  black.variance.at(1, 1) = std::numeric_limits<float>::infinity();
  EXPECT_EQ(merge(frames, {2, 2}, 1, kSensor, {.black = &black}).error().code, ErrorCode::bad_value);
  black.variance = Image<float>({2, 1});
  EXPECT_EQ(merge(frames, {2, 2}, 1, kSensor, {.black = &black}).error().code, ErrorCode::size_mismatch);
}

TEST(Average, AveragesWhatIsValid) {
  Radiance a{Image<float>({1, 3}, 1, 2.0F), Image<float>({1, 3}, 1, 4.0F), Image<std::uint8_t>({1, 3}, 1, 1)};
  Radiance b{Image<float>({1, 3}, 1, 6.0F), Image<float>({1, 3}, 1, 4.0F), Image<std::uint8_t>({1, 3}, 1, 1)};
  a.valid.at(0, 1) = a.valid.at(0, 2) = b.valid.at(0, 2) = 0;
  const auto mean = average(std::vector<Radiance>{a, b});
  ASSERT_TRUE(mean.ok());
  EXPECT_EQ(mean->mean, [] {
    Image<float> m({1, 3});
    m.at(0, 0) = 4;
    m.at(0, 1) = 6;
    return m;
  }());
  EXPECT_EQ(mean->variance, [] {
    Image<float> v({1, 3});
    v.at(0, 0) = 2;
    v.at(0, 1) = 4;
    return v;
  }());
  EXPECT_EQ(mean->valid.at(0, 2), 0);
  EXPECT_EQ(average({}).error().code, ErrorCode::bad_argument);
}

TEST(NoiseModel, OneSensorBuiltTwoWaysIsTheSame) {
  const NoiseModel line =
      NoiseModel::from_variance_line({.offset = kSensor.gain() * kSensor.gain() * kSensor.floor_variance(),
                                      .slope = kSensor.gain(),
                                      .bits = 12,
                                      .pedestal = 64});
  EXPECT_NEAR(line.read_noise(), kSensor.read_noise(), 1e-12);
  EXPECT_NEAR(line.full_well(), kSensor.full_well(), 1e-9);
  EXPECT_EQ(line.saturation_code(), kSensor.saturation_code());
}

TEST(NoiseModel, PrintsItself) {
  EXPECT_EQ(kSensor.to_string(),
            "12 bits, full well 20000 e-, read noise 6 e-, gain 0.20155 DN/e-, pedestal 64 DN, saturated "
            "from 4088 DN");
}

TEST(NoiseModel, RefusesNonsense) {
  EXPECT_TRUE(kSensor.valid());
  EXPECT_FALSE(NoiseModel::from_electrons({.bits = 17}).valid());
  EXPECT_FALSE(NoiseModel::from_electrons({.full_well = 0}).valid());
  EXPECT_FALSE(NoiseModel::from_electrons({.full_well = 100, .read_noise = 90})
                   .valid());  // nothing between pedestal and saturation
  EXPECT_FALSE(NoiseModel::from_electrons({.read_noise = std::numeric_limits<double>::quiet_NaN()}).valid());
}

}  // namespace
}  // namespace symrig::merge_test
