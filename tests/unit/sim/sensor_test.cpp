// SPDX-License-Identifier: Apache-2.0
#include "sim/sensor.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::sim::sensor_test {
namespace {

Sensor sensor(std::uint64_t seed = 1) {
  return {NoiseModel::from_electrons({}), 1e6, seed};
}

std::vector<std::uint16_t> expose(const Sensor& s, std::size_t pixels, double electrons,
                                  std::uint64_t frame) {
  const std::vector<float> radiance(pixels, static_cast<float>(electrons / 1e4));  // 10 ms at 1e6 e-/s
  std::vector<std::uint16_t> codes(pixels, 0xffff);
  s.expose(radiance, 0.01, frame, codes);
  return codes;
}

// Mean and variance against the noise model over 200,000 pixels: the mean has a sigma of σ/√n, the variance
// one of about σ² √(2/n); 5 sigmas each.
TEST(Sensor, follows_its_noise_model) {
  constexpr double kPixels = 200'000;
  const Sensor s = sensor();
  const double gain = s.noise.gain();
  for (const double electrons : {0.0, 3.0, 40.0, 60.0, 700.0, 15'000.0}) {
    const auto codes = expose(s, static_cast<std::size_t>(kPixels), electrons, 5);
    double sum = 0, squares = 0;
    for (const auto code : codes) sum += code;
    const double mean = sum / kPixels;
    for (const auto code : codes) squares += (code - mean) * (code - mean);
    const double expected = gain * gain * s.noise.variance(electrons);
    EXPECT_NEAR(mean, s.noise.pedestal() + gain * electrons, 5 * std::sqrt(expected / kPixels)) << electrons;
    EXPECT_NEAR(squares / kPixels / expected, 1, 5 * std::sqrt(2 / kPixels) + 0.002) << electrons;
  }
}

// A full well is the largest code; read noise of 1.2 DN moves it a little. Nothing wraps.
TEST(Sensor, saturates) {
  const Sensor s = sensor();
  for (const double electrons : {40'000.0, 1e9}) {
    for (const auto code : expose(s, 2000, electrons, 1)) {
      ASSERT_LE(code, s.noise.max_code());
      ASSERT_GE(code, s.noise.saturation_code());
    }
  }
}

TEST(Sensor, draws_by_seed_frame_and_pixel_alone) {
  const auto codes = expose(sensor(), 500, 300, 9);
  EXPECT_EQ(codes, expose(sensor(), 500, 300, 9));
  EXPECT_NE(codes, expose(sensor(), 500, 300, 10));
  EXPECT_NE(codes, expose(sensor(2), 500, 300, 9));
  const auto longer = expose(sensor(), 800, 300, 9);
  EXPECT_TRUE(std::equal(codes.begin(), codes.end(), longer.begin()));
}

// Neighbouring pixels and successive frames must not be correlated: |r| ≤ 5/√n.
TEST(Sensor, draws_independently) {
  constexpr std::size_t n = 100'000;
  const auto a = expose(sensor(), n, 100, 1);
  const auto b = expose(sensor(), n, 100, 2);
  const double mean = sensor().noise.pedestal() + sensor().noise.gain() * 100;
  double aa = 0, neighbour = 0, frame = 0;
  for (std::size_t i = 1; i < n; ++i) {
    aa += (a[i] - mean) * (a[i] - mean);
    neighbour += (a[i] - mean) * (a[i - 1] - mean);
    frame += (a[i] - mean) * (b[i] - mean);
  }
  EXPECT_LE(std::abs(neighbour / aa), 5 / std::sqrt(double(n)));
  EXPECT_LE(std::abs(frame / aa), 5 / std::sqrt(double(n)));
}

}  // namespace
}  // namespace symrig::sim::sensor_test
