// SPDX-License-Identifier: Apache-2.0
#include "acquisition/refine/direct_light.hpp"

#include "workbench.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::acquisition::direct_light_test {
namespace {

constexpr Grid kGrid{32, 32};
constexpr std::size_t kPixels = 1024;
constexpr double kSigmas = 5;

double truth(std::size_t pixel) {
  return 0.25 + 0.5 * Random(pixel).uniform();
}

/// A scene of direct light alone, `channels` alike, and its photographs.
class Direct {
 public:
  explicit Direct(int channels = 1)
      : tree_(kGrid), channels_(static_cast<std::size_t>(channels)), known(tree_, channels) {}

  /// Stores the diagonal, each entry wrong by `error`.
  void store(double error) {
    for (std::size_t t = 0; t < kPixels; ++t) {
      const std::vector<float> value(channels_, static_cast<float>(truth(t) + error));
      known.add_scalar(static_cast<std::int32_t>(t), static_cast<std::int32_t>(t), value);
    }
  }
  template <class Lit>
  TreePhotograph photograph(const Lit& lit, double sigma) {
    TreePhotograph p{std::vector<float>(kPixels), std::vector<float>(channels_ * kPixels),
                     std::vector<float>(channels_ * kPixels, static_cast<float>(sigma * sigma)),
                     std::vector<std::uint8_t>(channels_ * kPixels, 1)};
    for (std::size_t t = 0; t < kPixels; ++t) p.pattern[t] = lit(t);
    for (std::size_t at = 0; at < p.mean.size(); ++at) {
      const std::size_t t = at % kPixels;
      p.mean[at] = static_cast<float>(static_cast<double>(p.pattern[t]) *
                                          static_cast<double>(static_cast<float>(truth(t))) +
                                      sigma * gaussian_());
    }
    return p;
  }
  void refine(std::vector<TreePhotograph> photographs, DirectLight::Model model) {
    DirectLight direct(known, kPixels, std::move(model));
    known.subtract_from(photographs);
    direct.add(photographs);
    direct.apply(known);
  }
  double error(std::size_t pixel, std::size_t channel = 0) const {
    return static_cast<double>(known.scalar_values()[pixel * channels_ + channel]) -
           static_cast<double>(static_cast<float>(truth(pixel)));
  }

 private:
  BlockTree tree_;
  std::size_t channels_;
  tests::Gaussian gaussian_{77};

 public:
  KnownTransport known;
};

float everything(std::size_t /*pixel*/) {
  return 1;
}

TEST(DirectLight, noise_falls_with_the_root_of_the_times_lit) {
  constexpr double kSigma = 0.01;
  for (const int times : {1, 4, 16, 64}) {
    Direct scene;
    scene.store(0.03);  // where it starts does not matter
    std::vector<TreePhotograph> photographs;
    photographs.reserve(times);
    for (int k = 0; k < times; ++k) photographs.push_back(scene.photograph(everything, kSigma));
    scene.refine(std::move(photographs), {{0}, {0}});
    double squares = 0;
    for (std::size_t t = 0; t < kPixels; ++t) squares += std::pow(scene.error(t), 2);
    // n independent errors of variance σ²/times: their mean square is that, within √(2/n) (χ²).
    const double variance = kSigma * kSigma / times;
    EXPECT_NEAR(squares / kPixels, variance, kSigmas * variance * std::sqrt(2.0 / kPixels)) << times;
  }
}

TEST(DirectLight, each_pixel_gains_by_its_own_times_lit) {
  // Pixel t is lit in every photograph or in every fourth.
  constexpr double kSigma = 0.01;
  Direct scene;
  scene.store(0);
  std::vector<TreePhotograph> photographs;
  for (std::size_t k = 0; k < 32; ++k)
    photographs.push_back(
        scene.photograph([&](std::size_t t) { return t % 2 == 0 || k % 4 == 0 ? 1.0F : 0.0F; }, kSigma));
  scene.refine(std::move(photographs), {{0}, {0}});
  for (const std::size_t odd : {0U, 1U}) {
    double squares = 0;
    for (std::size_t t = odd; t < kPixels; t += 2) squares += std::pow(scene.error(t), 2);
    const double variance = kSigma * kSigma / (odd == 0 ? 32 : 8);
    EXPECT_NEAR(2 * squares / kPixels, variance, kSigmas * variance * std::sqrt(4.0 / kPixels)) << odd;
  }
}

TEST(DirectLight, a_noisier_photograph_counts_less) {
  // Variances σ² and 100 σ² weigh 1 and 1/100: together σ²/1.01, where a plain mean would have 101 σ²/4.
  constexpr double kSigma = 0.01;
  Direct scene;
  scene.store(0);
  scene.refine({scene.photograph(everything, kSigma), scene.photograph(everything, 10 * kSigma)}, {{0}, {0}});
  double squares = 0;
  for (std::size_t t = 0; t < kPixels; ++t) squares += std::pow(scene.error(t), 2);
  const double variance = kSigma * kSigma / 1.01;
  EXPECT_NEAR(squares / kPixels, variance, kSigmas * variance * std::sqrt(2.0 / kPixels));
}

TEST(DirectLight, exact_data_stay_exact_in_every_channel) {
  Direct scene(3);
  scene.store(0);
  scene.refine({scene.photograph(everything, 0),
                scene.photograph([](std::size_t t) { return t % 3 == 0 ? 1.0F : 0.0F; }, 0)},
               {{1e-6, 1e-6, 1e-6}, {1e-6, 0, 1}});
  for (std::size_t t = 0; t < kPixels; ++t)
    for (std::size_t channel = 0; channel < 3; ++channel) ASSERT_EQ(scene.error(t, channel), 0) << t;
}

TEST(DirectLight, exact_photographs_pull_a_wrong_entry_back) {
  Direct scene;
  scene.store(0.03);
  scene.refine({scene.photograph(everything, 0)}, {{1e-6}, {0}});
  // The residual of two floats below 1, then their sum: one rounding each.
  for (std::size_t t = 0; t < kPixels; ++t) ASSERT_NEAR(scene.error(t), 0, 2 * 0x1p-24) << t;
}

TEST(DirectLight, dark_and_invalid_samples_say_nothing) {
  Direct scene;
  scene.store(0);
  TreePhotograph photograph = scene.photograph([](std::size_t t) { return t % 2 == 0 ? 1.0F : 0.0F; }, 0);
  for (float& v : photograph.mean) v += 1;  // dark pixels see light from elsewhere
  for (std::size_t t = 0; t < kPixels; t += 4) photograph.valid[t] = 0;
  scene.refine({std::move(photograph)}, {{1e-6}, {0}});
  for (std::size_t t = 0; t < kPixels; ++t) {
    const bool speaks = t % 4 == 2;
    ASSERT_NEAR(scene.error(t), speaks ? 1 : 0, speaks ? 3 * 0x1p-23 : 0) << t;
  }
}

TEST(DirectLight, missed_light_of_a_flood_lit_photograph_is_not_taken_for_direct) {
  // A photograph with a sixteenth of the pixels lit and a flood-lit one, which misses m more than the model
  // knows, m² = 4 · half: it weighs least / (least + m²) of the other, so it moves an entry by that share of
  // m.
  constexpr double kMissed = 0.1, kLeast = 1e-6;
  Direct scene;
  scene.store(0);
  TreePhotograph sparse = scene.photograph([](std::size_t t) { return t % 16 == 0 ? 1.0F : 0.0F; }, 0);
  TreePhotograph flood = scene.photograph(everything, 0);
  for (float& v : flood.mean) v += static_cast<float>(kMissed);
  scene.refine({std::move(sparse), std::move(flood)}, {{kLeast}, {kMissed * kMissed / 4}});
  const double sparse_variance = kLeast + 4.0 / 256 * kMissed * kMissed / 4;
  const double flood_variance = kLeast + kMissed * kMissed;
  const double expected = kMissed * sparse_variance / (sparse_variance + flood_variance);
  EXPECT_LT(expected, 0.01 * kMissed);
  for (std::size_t t = 0; t < kPixels; t += 16) ASSERT_NEAR(scene.error(t), expected, 4 * 0x1p-24) << t;
}

}  // namespace
}  // namespace symrig::acquisition::direct_light_test
