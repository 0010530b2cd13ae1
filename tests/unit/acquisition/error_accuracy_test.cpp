// SPDX-License-Identifier: Apache-2.0
// How often the truth lies within the interval that a capture states: seeds and sizes that nothing was tuned
// on.
#include "dense_scene.hpp"
#include "judged_capture.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "workbench.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::error_interval_test {
namespace {

using tests::judge;
using tests::Judged;

constexpr std::array<double TransportErrors::*, 7> kErrors{
    &TransportErrors::frobenius,   &TransportErrors::indirect,       &TransportErrors::flood,
    &TransportErrors::relight_bar, &TransportErrors::relight_random, &TransportErrors::relight_natural,
    &TransportErrors::bar_indirect};

/// Counts how often the truth lies within the stated interval.
struct Coverage {
  int inside = 0, all = 0, narrow = 0;
  std::string missed;

  void add(const std::string& uri, const Judged& judged) {
    for (std::size_t k = 0; k < kErrors.size(); ++k) {
      const double value = (*judged.result.estimated).*kErrors[k];
      const double width = judged.result.estimated_half_width.*kErrors[k];
      if (std::isnan(value)) continue;
      const double truth = judged.truth.*kErrors[k];
      const bool in = std::abs(truth - value) <= width + 1e-6;
      ++all;
      inside += in ? 1 : 0;
      narrow += width < value ? 1 : 0;
      if (!in)
        missed += uri + " " + std::to_string(k) + ": " + std::to_string(truth) + " not in " +
                  std::to_string(value) + " +- " + std::to_string(width) + "\n";
    }
  }
  /// At the stated confidence, less three standard deviations of a binomial count.
  double least() const { return all * kErrorConfidence - 3 * std::sqrt(all * 0.95 * 0.05); }
};

constexpr const char* kScenes[] = {"plane", "vgroove-white", "vgroove-mixed", "vgroove-textured",
                                   "gummy", "occluder",      "mirror",        "views2",
                                   "views3"};

TEST(ErrorEstimate, the_truth_lies_within_the_stated_interval) {
  int narrow = 0, all = 0;
  for (const char* keys :
       {"?size=36x44&seed=907", "?size=36x44&seed=908&noise=off", "?size=29x31&seed=909&psf=0.08"}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + keys;
      coverage.add(uri, judge(uri));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << coverage.missed;
    narrow += coverage.narrow;
    all += coverage.all;
  }
  // With noise about as large as the errors on so few pixels, intervals of some errors reach down to 0: of
  // the third group, where light spreads, two of three do.
  EXPECT_GT(narrow, all / 3) << "intervals say something";
}

TEST(ErrorEstimate, of_a_search_that_a_budget_ended_too) {
  for (const std::int64_t most : {8, 24, 60}) {
    Coverage coverage;
    for (const char* scene : kScenes) {
      const std::string uri = std::string("sim:") + scene + "?size=33x40&seed=911";
      coverage.add(uri, judge(uri, most));
    }
    EXPECT_GE(coverage.inside, coverage.least()) << most << "\n" << coverage.missed;
  }
}

TEST(ErrorEstimate, of_indirect_light_is_within_its_interval_or_not_given_on_misaligned_rigs) {
  int given = 0, inside = 0;
  for (const char* scene : {"plane", "vgroove-textured", "gummy", "occluder"})
    for (const char* shift : {"0.1", "0.4", "1"}) {
      const std::string uri = std::string("sim:") + scene + "?size=28x32&seed=913&misalign=" + shift;
      const Judged judged = judge(uri, 0, true);
      const double value = judged.result.estimated->indirect;
      if (std::isnan(value)) {
        EXPECT_NE(judged.result.estimate_not_given[0].reason.find("one side"), std::string::npos) << uri;
        continue;
      }
      ++given;
      inside +=
          std::abs(value - judged.truth.indirect) <= judged.result.estimated_half_width.indirect ? 1 : 0;
    }
  EXPECT_LE(given - inside, 1) << "of " << given;
}

}  // namespace

}  // namespace symrig::error_interval_test

namespace symrig::noise_check_accuracy_test {

// Noise that is not as a probe promises, over many rigs and kinds of noise.

namespace {

using tests::check_of;
using tests::default_options;
using tests::Gaussian;
using tests::kSpoiledGrid;
using tests::kSpoiledSigma;
using tests::tells;

Image<float> noise(double sigma, unsigned seed) {
  Gaussian gaussian(seed);
  Image<float> image(kSpoiledGrid);
  for (float& v : image.values()) v = static_cast<float>(sigma * gaussian());
  return image;
}

void add(Radiance& to, const Image<float>& image) {
  for (std::size_t i = 0; i < image.values().size(); ++i) to.mean.values()[i] += image.values()[i];
}

TEST(NoiseCheck, honest_noise_is_not_complained_about) {
  for (const char* scene : {"plane", "vgroove-white", "vgroove-mixed", "vgroove-textured", "gummy",
                            "occluder", "mirror", "views2", "views3"})
    for (const char* keys : {"?size=32x40&seed=921", "?size=20x20&seed=922&channels=3",
                             "?size=24x32&seed=923&exposures=1", "?size=24x32&seed=924&noise=off"}) {
      const std::string uri = std::string("sim:") + scene + keys;
      const auto rig = open_virtual_rig(uri);
      ASSERT_TRUE(rig.ok());
      const auto result = capture(**rig, default_options());
      ASSERT_TRUE(result.ok());
      EXPECT_TRUE(result->noise_check.findings.empty()) << uri << ": " << result->noise_check.findings[0];
    }
  const NoiseCheck honest = check_of([](Radiance&, int) {});
  EXPECT_TRUE(honest.findings.empty()) << honest.findings[0];
  // Five photographs at least of 768 samples each, differences of neighbours correlated by a half: the ratio
  // of squares is known to √(2 · 1.5 / 3072) = 3 %.
  EXPECT_NEAR(honest.variance_ratio, 1, 5 * 0.032);
}

TEST(NoiseCheck, a_variance_that_is_wrong_by_three_is_told) {
  const auto state = [](double factor) {
    return check_of([=](Radiance& answer, int) {
      for (float& v : answer.variance.values()) v *= static_cast<float>(factor);
    });
  };
  const NoiseCheck small = state(1 / 3.0);
  EXPECT_TRUE(tells(small, "variance"));
  EXPECT_NEAR(small.variance_ratio, 3, 0.5);
  const NoiseCheck large = state(3);
  EXPECT_TRUE(tells(large, "variance"));
  EXPECT_NEAR(large.variance_ratio, 1 / 3.0, 0.06);
}

TEST(NoiseCheck, noise_that_all_photographs_share_is_told) {
  const Image<float> common = noise(2 * kSpoiledSigma, 31);
  EXPECT_TRUE(tells(check_of([&](Radiance& answer, int) { add(answer, common); }), "add up"));
  // The same and nothing else: photographs of the same light are equal, against what they state.
  const Image<float> only = noise(kSpoiledSigma, 32);
  const NoiseCheck equal = check_of(
      [&](Radiance& answer, int) {
        add(answer, only);
        for (float& v : answer.variance.values()) v = static_cast<float>(kSpoiledSigma * kSpoiledSigma);
      },
      0);
  EXPECT_TRUE(tells(equal, "share"));
}

TEST(NoiseCheck, noise_of_rows_and_blurred_noise_are_told) {
  const NoiseCheck rows = check_of([](Radiance& answer, int photograph) {
    Gaussian gaussian(static_cast<std::uint64_t>(photograph) + 100);
    for (int r = 0; r < kSpoiledGrid.rows; ++r) {
      const auto one = static_cast<float>(kSpoiledSigma * gaussian());
      for (int c = 0; c < kSpoiledGrid.cols; ++c) answer.mean.at(r, c) += one;
    }
    for (float& v : answer.variance.values()) v *= 2;  // stated as it is, pixel by pixel
  });
  EXPECT_TRUE(tells(rows, "neighbouring"));
  const NoiseCheck blurred = check_of(
      [](Radiance& answer, int photograph) {
        const Image<float> white = noise(kSpoiledSigma, static_cast<unsigned>(photograph) + 500);
        for (int r = 0; r < kSpoiledGrid.rows; ++r)
          for (int c = 0; c + 1 < kSpoiledGrid.cols; ++c)
            answer.mean.at(r, c) += white.at(r, c) + white.at(r, c + 1);
        for (float& v : answer.variance.values()) v = static_cast<float>(2 * kSpoiledSigma * kSpoiledSigma);
      },
      0);
  EXPECT_TRUE(tells(blurred, "neighbouring"));
}

}  // namespace

}  // namespace symrig::noise_check_accuracy_test

// Numerical stability: matrices that a search finds hard, against themselves in double precision.
namespace symrig::stability_test {
namespace {

using tests::DenseTransport;
using tests::Matrix;
using tests::Outcome;

constexpr int kSide = 16, kPixels = kSide * kSide;
constexpr Grid kSquare{kSide, kSide};

/// A smooth scene with its albedo.
Matrix smooth(int pixels, int cols) {
  Random random(7);
  const Eigen::VectorXd albedo =
      Eigen::VectorXd::NullaryExpr(pixels, [&random] { return 0.1 + 0.9 * random.uniform(); });
  return Matrix::NullaryExpr(pixels, pixels, [&](Eigen::Index i, Eigen::Index j) {
    const Eigen::Index down = i / cols - j / cols, right = i % cols - j % cols;
    const auto square = static_cast<double>(down * down + right * right);
    const double light = std::exp(-square / 30) / 60 * albedo(i) * albedo(j);
    return light + (i == j ? albedo(i) : 0);
  });
}

/// Orthogonal vectors with these eigenvalues. share: number of the eigenvalue over all.
Matrix with_spectrum(const std::function<double(double share)>& eigenvalue) {
  const Matrix q = Eigen::HouseholderQR<Matrix>(tests::gaussian(kPixels, 3)).householderQ();
  const Eigen::VectorXd values = Eigen::VectorXd::NullaryExpr(
      kPixels, [&](Eigen::Index k) { return eigenvalue(static_cast<double>(k) / kPixels); });
  return q * values.asDiagonal() * q.transpose();
}

Matrix checkerboard(double direct) {
  const auto colour = [](Eigen::Index i) { return (i / kSide + i % kSide) % 2; };
  return Matrix::NullaryExpr(kPixels, kPixels, [=](Eigen::Index i, Eigen::Index j) {
    const double own = i == j ? direct * (0.5 + 0.5 * static_cast<double>(i % 7) / 6) : 0;
    return (colour(i) == colour(j) ? 1.0 / kPixels : 0) + own;
  });
}

/// Light of pixels over so many decades, around 1.
Matrix over_decades(double decades) {
  Random random(8);
  const Eigen::VectorXd root = Eigen::VectorXd::NullaryExpr(
      kPixels, [&] { return std::pow(10, decades * (random.uniform() - 0.5) / 2); });
  return root.asDiagonal() * smooth(kPixels, kSide) * root.asDiagonal();
}

/// Each of the two columns at the border of the largest blocks sees the other; direct light beside.
Matrix mirror_at_border() {
  Matrix t = Matrix::Identity(kPixels, kPixels);
  for (int row = 0; row < kSide; ++row) {
    const int left = row * kSide + kSide / 2 - 1;
    t(left, left + 1) = t(left + 1, left) = 1;
  }
  return t;
}

Matrix single_path() {
  Matrix t = Matrix::Zero(kPixels, kPixels);
  t(3, kPixels - 5) = t(kPixels - 5, 3) = 1;
  return t;
}

Matrix with_gain(double by) {
  const Eigen::VectorXd gain = Eigen::VectorXd::NullaryExpr(
      kPixels, [by](Eigen::Index i) { return 1 + by * std::sin(3.0 * static_cast<double>(i) / kPixels); });
  return gain.asDiagonal() * smooth(kPixels, kSide);
}

struct Hard {
  const char* name;
  Grid grid;
  Matrix t;
};

std::vector<Hard> hard_matrices() {
  return {
      {"flat spectrum", kSquare, with_spectrum([](double x) { return x < 0.5 ? 1 : -1; })},
      {"steep spectrum, 1 to 1e-12", kSquare, with_spectrum([](double x) { return std::pow(10, -12 * x); })},
      {"clustered spectrum: 1, 1e-3, 1e-6", kSquare, with_spectrum([](double x) {
         return x < 0.1 ? 1 : x < 0.4 ? 1e-3 : 1e-6;
       })},
      {"checkerboard", kSquare, checkerboard(0)},
      {"checkerboard with direct light", kSquare, checkerboard(1)},
      {"permutation", kSquare, tests::pairs(kPixels, 5)},
      {"smooth, light over 12 decades", kSquare, over_decades(12)},
      {"smooth, light over 24 decades", kSquare, over_decades(24)},
      {"smooth, gain 0.1 %", kSquare, with_gain(1e-3)},
      {"smooth, gain 1 %", kSquare, with_gain(1e-2)},
      {"smooth, gain 5 %", kSquare, with_gain(5e-2)},
      {"smooth, 1x300", {1, 300}, smooth(300, 300)},
      {"single light path", kSquare, single_path()},
      {"mirror at a border of blocks", kSquare, mirror_at_border()}};
}

/// The relative Frobenius error, column by column in double precision.
double exact_error(const TransportTensor& tensor, const Matrix& t) {
  double error = 0;
  for (Eigen::Index j = 0; j < t.cols(); ++j) {
    Image<float> one(tensor.projector_grid());
    one.values()[static_cast<std::size_t>(j)] = 1;
    const auto column = tensor.apply(one);
    EXPECT_TRUE(column.ok());
    for (Eigen::Index i = 0; i < t.rows(); ++i)
      error += std::pow(static_cast<double>(column->values()[static_cast<std::size_t>(i)]) - t(i, j), 2);
  }
  return std::sqrt(error) / t.norm();
}

// docs/research/error-estimates.md prints the lines. Noise is a thousandth of the RMS of the flood-lit scene.
TEST(Stability, no_hard_matrix_ends_done_with_an_error_above_three_times_the_stated_one) {
  for (const Hard& hard : hard_matrices())
    for (const bool noisy : {false, true}) {
      const DenseTransport scene(hard.grid, [&](int i, int j) { return hard.t(i, j); });
      const double flood = hard.t.rowwise().sum().norm() / std::sqrt(static_cast<double>(hard.t.rows()));
      const Outcome outcome = tests::run(scene, {.unchecked = true}, noisy ? 1e-3 * flood : 0);
      const CaptureResult& result = outcome.result;
      const double error = exact_error(result.tensor, hard.t);
      ASSERT_TRUE(std::isfinite(error)) << hard.name;
      EXPECT_LE(result.patterns, hard.t.rows()) << hard.name;
      const double stated = result.stated_error().value_or(std::nan(""));
      std::printf("| %s%s | %d | %d | %.1e | %.1e |\n", hard.name, noisy ? ", noise" : "",
                  static_cast<int>(result.patterns), static_cast<int>(hard.t.rows()), error, stated);
      // Rounding of photographs to floats, summed over a photograph's pixels.
      const double rounding = 0x1p-24 * static_cast<double>(hard.t.rows());
      EXPECT_LE(error, 3 * stated + rounding) << hard.name << (noisy ? " with noise" : "");
    }
}

}  // namespace
}  // namespace symrig::stability_test
