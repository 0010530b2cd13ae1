// SPDX-License-Identifier: Apache-2.0
// Whole captures of scenes of other shapes, colours and kinds.
#include "dense_scene.hpp"
#include "symrig/sim/scene.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/global_control.h>

namespace symrig::scenes_test {
namespace {

using tests::default_options;
using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;

/// Three scenes seen as three channels of one.
class ColourProbe : public Probe {
 public:
  explicit ColourProbe(std::vector<DenseTransport> planes, double sigma = 0)
      : planes_(std::move(planes)), sigma_(sigma) {}
  Grid grid() const override { return planes_[0].grid(); }
  int channels() const override { return static_cast<int>(planes_.size()); }
  Image<float> image(const Image<float>& p) const {
    Image<float> all(grid(), channels());
    for (int c = 0; c < channels(); ++c) {
      const Image<float> one = planes_[c].apply(p);
      std::ranges::copy(one.values(), all.plane(c).begin());
    }
    return all;
  }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    std::vector<Radiance> answers;
    for (const Pattern& p : patterns) {
      Radiance answer{image(p), Image<float>(grid(), channels(), static_cast<float>(sigma_ * sigma_)),
                      Image<std::uint8_t>(grid(), channels(), std::uint8_t{1})};
      for (float& v : answer.mean.values()) v += static_cast<float>(sigma_ * gaussian_());
      answers.push_back(std::move(answer));
    }
    photographs_ += std::ssize(patterns);
    return answers;
  }
  ProbeCost cost() const override { return {photographs_, photographs_, 0, 0, 0}; }
  std::string describe() const override { return "colours"; }

 private:
  std::vector<DenseTransport> planes_;
  double sigma_;
  tests::Gaussian gaussian_{4};
  std::int64_t photographs_ = 0;
};

/// A leaf may miss a sample by τ_A F + τ_R of its signal (RMS): indirect light is 0.2 of the direct, so 0.02
/// · 0.2 + 3e-4 √levels is above what may remain.
constexpr double kBound = 0.006;

TEST(Scenes, three_channels_are_each_as_good_as_one) {
  const Grid grid{16, 16};
  ColourProbe probe({facing_planes(grid, 0.2), facing_planes(grid, 0.05),
                     DenseTransport(grid, [](int i, int j) { return i == j ? 0.1 + 0.001 * i : 0.0; })});
  const auto result = capture(probe, default_options());
  ASSERT_TRUE(result.ok());
  EXPECT_EQ(result->tensor.channels(), 3);
  const Image<float> lit = random_pattern(grid, 3);
  const Image<float> estimate = *result->tensor.apply(lit);
  const Image<float> truth = probe.image(lit);
  for (int c = 0; c < 3; ++c) {
    double error = 0, signal = 0;
    for (std::size_t t = 0; t < 256; ++t) {
      const double y = truth.plane(c)[t];
      error += std::pow(static_cast<double>(estimate.plane(c)[t]) - y, 2);
      signal += y * y;
    }
    EXPECT_LE(std::sqrt(error / signal), kBound) << c;
  }
}

TEST(Scenes, a_colour_cast_changes_no_decision) {
  // Tolerances refer to each channel's own flood-lit photograph, so a channel scaled by a power of two, which
  // scales every float exactly, leaves patterns and leaves as they were.
  const Grid grid{13, 17};
  const DenseTransport plane = facing_planes(grid);
  const auto scaled = [&](double by) {
    return DenseTransport(grid, [&](int i, int j) { return by * plane.at(i, j); });
  };
  ColourProbe grey({scaled(1), scaled(1), scaled(1)}), cast({scaled(1), scaled(0.25), scaled(8)});
  const auto a = capture(grey, default_options());
  const auto b = capture(cast, default_options());
  EXPECT_EQ(a->patterns, b->patterns);
  EXPECT_EQ(a->tensor.leaves().size(), b->tensor.leaves().size());
  EXPECT_EQ(a->tensor.scalars().size(), b->tensor.scalars().size());
}

TEST(Scenes, any_shape_is_captured) {
  for (const Grid grid : {Grid{1, 2}, Grid{2, 1}, Grid{1, 31}, Grid{31, 1}, Grid{1, 64}, Grid{64, 1},
                          Grid{2, 3}, Grid{3, 2}, Grid{7, 11}, Grid{11, 7}, Grid{13, 13}, Grid{2, 53}}) {
    const DenseTransport scene = facing_planes(grid);
    DenseProbe probe(scene);
    const auto result = capture(probe, default_options());
    ASSERT_TRUE(result.ok()) << to_string(grid);
    const auto errors = evaluate(result->tensor, scene.truth());
    EXPECT_LE(errors->frobenius, kBound) << to_string(grid);
    EXPECT_LE(errors->flood, kBound) << to_string(grid);
  }
}

TEST(Scenes, noise_alone_stores_nothing) {
  for (const Grid grid : {Grid{8, 8}, Grid{16, 16}, Grid{13, 17}}) {
    const DenseTransport black(grid, [](int, int) { return 0.0; });
    DenseProbe probe(black, 0.01);
    CaptureOptions unchecked = default_options();
    unchecked.unchecked = true;
    const auto result = capture(probe, unchecked);
    ASSERT_TRUE(result.ok());
    // The flood-lit photograph is no brighter than its noise explains (3 standard deviations of χ²).
    EXPECT_TRUE(result->tensor.leaves().empty()) << to_string(grid);
    EXPECT_TRUE(result->tensor.scalars().empty()) << to_string(grid);
    EXPECT_EQ(result->patterns, 1) << to_string(grid);
  }
}

/// Nothing about it is data-sparse: independent entries, all blocks of full rank.
DenseTransport random_scene(Grid grid) {
  const auto n = static_cast<std::uint64_t>(grid.size());
  return {grid, [n](int i, int j) {
            const auto a = static_cast<std::uint64_t>(std::max(i, j)),
                       b = static_cast<std::uint64_t>(std::min(i, j));
            return 0.01 * Random(a * n + b).uniform();
          }};
}

TEST(Scenes, random_transport_is_exact_or_said_to_be_wrong) {
  const DenseTransport scene = random_scene(Grid{16, 16});
  DenseProbe probe(scene);
  const auto result = capture(probe, default_options());
  ASSERT_TRUE(result.ok());
  const double error = evaluate(result->tensor, scene.truth())->frobenius;
  ASSERT_TRUE(result->estimated.has_value());
  // Twelve random vectors against one: the estimate of a full-rank error of 256 columns scatters by √(2/256)
  // of its square at the least, by more where few directions hold it; half is far outside.
  EXPECT_GE(result->estimated->frobenius, 0.5 * error - 1e-5);
  EXPECT_LE(result->estimated->frobenius, 2 * error + 1e-5);
  EXPECT_LE(result->patterns, 4 * 256) << "it ends: at most a few times brute force";
}

TEST(Scenes, numbers_do_not_depend_on_threads) {
  const DenseTransport scene = facing_planes(Grid{32, 32});
  std::vector<CaptureResult> results;
  for (const std::size_t threads : {1U, 2U}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    DenseProbe probe(scene, 1e-3);
    CaptureOptions options = default_options();
    options.economy->polish = 1;
    results.push_back(std::move(*capture(probe, options)));
  }
  const TransportTensor& one = results[0].tensor;
  const TransportTensor& two = results[1].tensor;
  EXPECT_EQ(results[0].patterns, results[1].patterns);
  ASSERT_FALSE(one.factors()->empty());
  EXPECT_TRUE(std::ranges::equal(*one.factors(), *two.factors()));
  EXPECT_TRUE(std::ranges::equal(one.scalar_values(), two.scalar_values()));
  EXPECT_EQ(one.leaves().size(), two.leaves().size());
  EXPECT_EQ(results[0].estimated->frobenius, results[1].estimated->frobenius);
}

}  // namespace
}  // namespace symrig::scenes_test
