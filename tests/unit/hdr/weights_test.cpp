// SPDX-License-Identifier: Apache-2.0
// The merge against the weights of Debevec and Malik, and of Robertson, Borman and Stevenson, on the same
// frames.
#include "simulated_sensor.hpp"

#include <functional>

#include <gtest/gtest.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;

const NoiseModel kSensor = NoiseModel::from_electrons({});
constexpr Grid kGrid{200, 250};
constexpr std::size_t kPixels = 50'000;

/// Σ w x / Σ w per pixel with a published weight; both as they are for a linear camera, saturated samples
/// out.
using Weight = std::function<double(double code, double seconds)>;
double mean_square_error(const std::vector<Frame>& frames, double rate, const Weight& weight) {
  double squares = 0;
  for (std::size_t i = 0; i < kPixels; ++i) {
    double sum = 0, weights = 0;
    for (const Frame& f : frames) {
      if (f.raw[i] >= kSensor.saturation_code()) continue;
      const double t = seconds(f.exposure);
      const double w = weight(f.raw[i], t);
      sum += w * (f.raw[i] - kSensor.pedestal()) / kSensor.gain() / t;
      weights += w;
    }
    squares += std::pow(weights > 0 ? sum / weights - rate : rate, 2) / kPixels;
  }
  return squares;
}

/// [Debevec97 eq. 4]: a hat over the codes. (There in ln E; for a linear camera the mean of E itself is
/// kinder to it: dark samples have no logarithm.)
double hat(double code, double /*seconds*/) {
  return std::max(1e-6, std::min(code, kSensor.max_code() - code));
}
/// [Robertson99]: t² times a Gaussian about the middle code.
double bell(double code, double t) {
  const double middle = kSensor.max_code() / 2.0, x = (code - middle) / middle;
  return t * t * std::exp(-4 * x * x);
}

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
  double ours = 0;
  for (const float m : merged->mean.values()) ours += std::pow(static_cast<double>(m) - rate, 2) / kPixels;
  const double debevec = mean_square_error(bracket.frames(), rate, hat);
  const double robertson = mean_square_error(bracket.frames(), rate, bell);
  RecordProperty("snr_gain_debevec_db", std::to_string(10 * std::log10(debevec / ours)));
  RecordProperty("snr_gain_robertson_db", std::to_string(10 * std::log10(robertson / ours)));
  EXPECT_LT(ours, debevec * (GetParam() == 0 ? 1.02 : 1.001));
  EXPECT_LT(ours, robertson * (GetParam() == 0 ? 1.02 : 1.001));
}
INSTANTIATE_TEST_SUITE_P(Levels, Contest,
                         testing::Values(0., 10., 100., 1'000., 10'000., 18'000., 30'000., 80'000., 145'000.,
                                         300'000., 1e6, 3e6, 9e6));

}  // namespace
}  // namespace symrig
