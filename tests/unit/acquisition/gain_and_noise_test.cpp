// SPDX-License-Identifier: Apache-2.0
// A camera and a projector whose gains differ over the picture: a search sees it by reciprocity.
#include "acquisition/errors/gain_mismatch.hpp"
#include "acquisition/tree/node.hpp"
#include "dense_scene.hpp"
#include "judged_capture.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/probe.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::gain_mismatch_test {
namespace {

constexpr Grid kGrid{32, 32};
constexpr double kNoise = 1e-4;

/// log(c / p) of each pixel, by shapes.
std::vector<double> gain_of(const GainShapes& weights) {
  std::vector<double> gain;
  for (const GainShapes& shape : gain_shapes(kGrid))
    gain.push_back(std::inner_product(shape.begin(), shape.end(), weights.begin(), 0.0));
  return gain;
}

double rms(const std::vector<double>& values) {
  return std::sqrt(std::inner_product(values.begin(), values.end(), values.begin(), 0.0) /
                   static_cast<double>(values.size()));
}

struct Seen {
  CaptureResult result;
  TransportErrors truth;
};

/// A capture by a camera with these gains. veil: share of all light that every pixel gets its part of.
Seen captured(const GainShapes& weights, double veil = 0) {
  const tests::DenseTransport scene = tests::facing_planes(kGrid);
  const std::vector<double> gain = gain_of(weights);
  tests::DenseProbe probe(scene, kNoise);
  probe.spoil = [&](Radiance& photograph) {
    const auto values = photograph.mean.values();
    const double all =
        std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<float>(static_cast<double>(values[i]) * std::exp(gain[i]) + veil * all);
  };
  auto result = capture(probe, tests::default_options());
  EXPECT_TRUE(result.ok());
  const auto truth = evaluate(result->tensor, scene.truth());
  return {*std::move(result), *truth};
}

TEST(GainMismatch, none_is_found_where_there_is_none) {
  const GainMismatch found = captured({}).result.gain_mismatch;
  EXPECT_FALSE(found.found);
  EXPECT_GT(found.sigma, 0);
  EXPECT_LT(found.rms, 0.003);
}

TEST(GainMismatch, veiling_glare_is_not_taken_for_it) {
  const GainMismatch found = captured({}, 0.002).result.gain_mismatch;
  EXPECT_FALSE(found.found) << found.rms << " ± " << found.sigma;
}

// log g of the pixels, against the fitted shapes: r² and r⁴ are alike, so their weights alone say little.
TEST(GainMismatch, is_the_true_one) {
  for (const GainShapes& planted :
       {GainShapes{0.04, -0.03, 0, 0}, GainShapes{0, 0, -0.1, 0}, GainShapes{0, 0.02, 0.1, 0.05}}) {
    const GainMismatch found = captured(planted).result.gain_mismatch;
    ASSERT_TRUE(found.found) << found.rms << " ± " << found.sigma;
    std::vector<double> off = gain_of(found.shape), truth = gain_of(planted);
    for (std::size_t i = 0; i < off.size(); ++i) off[i] -= truth[i];
    EXPECT_NEAR(found.rms, rms(truth), 4 * found.sigma);
    EXPECT_LT(rms(off), 4 * found.sigma);
  }
}

// Errors between pixels are those of the gain: ½ (ε_i + ε_j).
TEST(GainMismatch, is_part_of_the_estimated_errors) {
  const Seen seen = captured({0, 0, -0.1, 0});
  const TransportErrors& said = *seen.result.estimated;
  EXPECT_GT(seen.truth.frobenius, 0.015);
  EXPECT_NEAR(said.frobenius / seen.truth.frobenius, 1, 0.2);
  EXPECT_NEAR(said.flood / seen.truth.flood, 1, 0.2);
  EXPECT_NEAR(said.bar_indirect / seen.truth.bar_indirect, 1, 0.2);
  EXPECT_NEAR(said.relight_bar / seen.truth.relight_bar, 1, 0.2);
}

/// A camera that answers each photograph in three equal channels.
class ThreeEqualChannels final : public ForwardingProbe {
 public:
  using ForwardingProbe::ForwardingProbe;
  int channels() const override { return 3; }

 private:
  Result<std::vector<Radiance>> seen(std::span<const Pattern>,
                                     Result<std::vector<Radiance>> photographs) override {
    if (!photographs) return photographs;
    for (Radiance& one : *photographs)
      one = {repeated(one.mean), repeated(one.variance), repeated(one.valid)};
    return photographs;
  }
  template <class T>
  static Image<T> repeated(const Image<T>& image) {
    Image<T> three(image.grid(), 3);
    for (int channel = 0; channel < 3; ++channel)
      std::ranges::copy(image.plane(0), three.plane(channel).begin());
    return three;
  }
};

// What a node's photographs hold of other light is in all its channels: three of them know no more than one.
TEST(GainMismatch, channels_are_no_evidence_of_their_own) {
  const tests::DenseTransport scene = tests::facing_planes(kGrid);
  tests::DenseProbe one(scene, kNoise), other(scene, kNoise);
  ThreeEqualChannels three(other);
  const auto alone = capture(one, tests::default_options()),
             together = capture(three, tests::default_options());
  ASSERT_TRUE(alone.ok() && together.ok());
  // Independent channels would leave 1 / sqrt(3).
  EXPECT_NEAR(together->gain_mismatch.sigma / alone->gain_mismatch.sigma, 1, 0.2);
}

// Light of others that one photograph of a block holds is in all pairs of that block: 64 such errors, not one
// for each of a thousand pairs. Then a rig without a mismatch has one by less than the sigma of independent
// pairs in hardly any draw.
TEST(GainMismatch, pairs_with_a_block_in_common_do_not_err_alone) {
  constexpr int kDraws = 100, kLevel = 3;
  constexpr double kError = 0.01;
  const BlockTree tree(kGrid);
  const auto found_in = [&](bool shared) {
    std::mt19937_64 random(5);
    std::normal_distribution<double> normal;
    int found = 0;
    for (int draw = 0; draw < kDraws; ++draw) {
      acquisition::NodeLevel level(tree, kLevel, 1);
      std::vector<double> error(static_cast<std::size_t>(level.block_count()));
      for (double& one : error) one = kError * normal(random);
      const std::vector<acquisition::PairNoise> noise{{1e-9F, 16}};
      for (std::int32_t i = 0; i < level.block_count(); ++i)
        for (std::int32_t j = 0; j < i; ++j) {
          const double ratio = shared
                                   ? error[static_cast<std::size_t>(i)] - error[static_cast<std::size_t>(j)]
                                   : kError * normal(random);
          const std::vector<float> c(level.block(i).size(), static_cast<float>(std::exp(ratio))),
              r(level.block(j).size(), 1.0F);
          level.add(i, j, c, r, noise, noise, 0);
        }
      acquisition::GainEvidence evidence(tree);
      evidence.add(level);
      found += evidence.fit().found ? 1 : 0;
    }
    return found;
  };
  EXPECT_LE(found_in(true), 2);
  EXPECT_LE(found_in(false), 2);
}

class Coaxial : public testing::TestWithParam<const char*> {};

TEST_P(Coaxial, rigs_have_none) {
  for (const char* seed : {"921", "922"}) {
    const tests::Judged judged = tests::judge(std::string("sim:") + GetParam() + "?size=32x32&seed=" + seed);
    EXPECT_FALSE(judged.result.gain_mismatch.found)
        << judged.result.gain_mismatch.rms << " ± " << judged.result.gain_mismatch.sigma;
  }
}

INSTANTIATE_TEST_SUITE_P(Scenes, Coaxial,
                         testing::Values("plane", "vgroove-white", "vgroove-textured", "gummy", "occluder",
                                         "mirror", "views2"));

}  // namespace

}  // namespace symrig::gain_mismatch_test

namespace symrig::noise_check_test {

// Noise that is not as a probe promises: told when gross, and never where it is as promised.

namespace {

using tests::check_of;
using tests::tells;

TEST(NoiseCheck, a_lamp_that_flickers_slowly_is_told) {
  const NoiseCheck check = check_of([](Radiance& answer, int photograph) {
    const auto level = static_cast<float>(1 + 0.03 * std::sin(0.05 * photograph));
    for (float& v : answer.mean.values()) v *= level;
  });
  EXPECT_TRUE(tells(check, "light changed"));
}

TEST(NoiseCheck, photographs_without_a_variance_must_have_no_noise) {
  const NoiseCheck check = check_of(
      [](Radiance& answer, int) {
        for (float& v : answer.variance.values()) v = 0;
      },
      0.01);
  EXPECT_TRUE(tells(check, "state no noise"));
}

}  // namespace

}  // namespace symrig::noise_check_test
