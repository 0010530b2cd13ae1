// SPDX-License-Identifier: Apache-2.0
// Leaves that the held-out photographs find wrong: where there are none, and where there are too many to
// mend.
#include "dense_scene.hpp"
#include "workbench.hpp"

#include <gtest/gtest.h>

namespace symrig::suspects_test {
namespace {

using tests::default_options;
using tests::DenseProbe;
using tests::DenseTransport;
using tests::facing_planes;

constexpr std::int64_t kChecks = 6;

TEST(Suspects, well_behaved_scenes_raise_no_alarm) {
  for (const Grid grid : {Grid{16, 16}, Grid{13, 17}, Grid{20, 20}}) {
    const DenseTransport scene = facing_planes(grid);
    for (const double sigma : {0.0, 1e-4, 1e-3}) {
      DenseProbe probe(scene, sigma);
      const auto result = capture(probe, default_options());
      ASSERT_TRUE(result.ok());
      EXPECT_EQ(result->suspects, 0) << to_string(grid) << ' ' << sigma;
    }
  }
}

TEST(Suspects, without_an_alarm_the_checks_cost_their_six_photographs_only) {
  for (const Grid grid : {Grid{16, 16}, Grid{13, 17}, Grid{20, 20}}) {
    const DenseTransport scene = facing_planes(grid);
    CaptureOptions six = default_options();
    six.economy->check_share = 0;
    CaptureOptions blind = six;
    blind.economy->checks = false;
    DenseProbe with(scene), without(scene);
    EXPECT_EQ(capture(with, six)->patterns, capture(without, blind)->patterns + kChecks) << to_string(grid);
  }
}

/// Light goes only between pixels of one colour of a checkerboard, all alike: T p is two sums.
class Checkerboard : public Probe {
 public:
  explicit Checkerboard(int side) : side_(side) {}
  Grid grid() const override { return {side_, side_}; }
  int channels() const override { return 1; }
  Image<float> image(const Image<float>& p) const {
    double sums[2] = {};
    for (int i = 0; i < side_ * side_; ++i) sums[colour(i)] += static_cast<double>(p.values()[i]);
    Image<float> y(grid());
    for (int i = 0; i < side_ * side_; ++i) y.values()[i] = static_cast<float>(0.001 * sums[colour(i)]);
    return y;
  }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    std::vector<Radiance> answers;
    for (const Pattern& p : patterns)
      answers.push_back({image(p), Image<float>(grid()), Image<std::uint8_t>(grid(), 1, std::uint8_t{1})});
    photographs_ += std::ssize(patterns);
    return answers;
  }
  ProbeCost cost() const override { return {photographs_, photographs_, 0, 0, 0}; }
  std::string describe() const override { return "checkerboard"; }

 private:
  int colour(int i) const { return (i / side_ + i % side_) % 2; }
  int side_;
  std::int64_t photographs_ = 0;
};

TEST(Suspects, a_checkerboard_too_large_for_the_budget_is_told) {
  Checkerboard scene(64);
  CaptureOptions options = default_options();
  options.max_patterns = 1000;  // brute force takes 4096
  const auto result = capture(scene, options);
  ASSERT_TRUE(result.ok());
  EXPECT_LE(result->patterns, options.max_patterns);
  const auto truth =
      evaluate(result->tensor, [&](const Image<float>& p) -> Result<Image<float>> { return scene.image(p); });
  // T is (11' + ss')/2 of equal norms, s = ±1 by colour; block patterns see the first half only.
  EXPECT_GT(truth->frobenius, 0.3);
  ASSERT_TRUE(result->estimated.has_value());
  EXPECT_GT(result->suspects, 0);
  EXPECT_GT(result->estimated->frobenius, 0.1);
  ASSERT_TRUE(result->undetermined);
  EXPECT_FALSE(result->undetermined->completed);
}

}  // namespace
}  // namespace symrig::suspects_test
