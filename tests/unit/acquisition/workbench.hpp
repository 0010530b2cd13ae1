// SPDX-License-Identifier: Apache-2.0
// What the parts of a hierarchical capture need to be tested one by one.
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/search_facts.hpp"
#include "dense_scene.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/base/statistics.hpp"

#include <cmath>
#include <cstdint>
#include <iterator>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace symrig::tests {

/// Standard normal numbers, the same on every machine but for the last bit of log and cos (Box and Muller).
class Gaussian {
 public:
  explicit Gaussian(std::uint64_t seed) : random_(seed) {}
  double operator()() {
    return std::sqrt(-2 * std::log(1 - random_.uniform())) * std::cos(6.283185307179586 * random_.uniform());
  }

 private:
  Random random_;
};

/// What a search needs around a probe and its log: F = 1 in every channel, and nothing is known.
struct Workbench {
  explicit Workbench(Probe& probe)
      : tree(probe.grid()),
        log(make_memory_log(probe.grid(), probe.channels())),
        logged(probe, *log, 32),
        photographer(logged, log.get(), tree, {}),
        known(tree, probe.channels()),
        facts{options, tree, probe.channels(), std::vector<double>(probe.channels(), 1.0)} {}

  CaptureSettings options;
  BlockTree tree;
  std::unique_ptr<PhotographLog> log;
  LoggedProbe logged;
  acquisition::Photographer photographer;
  acquisition::KnownTransport known;
  acquisition::SearchFacts facts;
};

/// Runs the default capture.
inline CaptureOptions default_options() {
  return {.rule = default_rule(Algorithm::symrig), .economy = default_economy(Algorithm::symrig)};
}

// Transport matrices that a search finds hard, and captures of them.

using Matrix = Eigen::MatrixXd;

inline DenseTransport transport(Grid grid, const Matrix& t) {
  return {grid, [&t](int i, int j) { return (t(i, j) + t(j, i)) / 2; }};
}

inline Matrix gaussian(int n, std::uint64_t seed) {
  tests::Gaussian random(seed);
  return Matrix::NullaryExpr(n, n, [&random] { return random(); });
}

/// Symmetric and orthogonal: all singular values are 1, whatever its blocks.
inline Matrix flat_spectrum(int n, std::uint64_t seed) {
  const Matrix q = Eigen::HouseholderQR<Matrix>(gaussian(n, seed)).householderQ();
  Random random(seed + 1);
  const Eigen::VectorXd signs =
      Eigen::VectorXd::NullaryExpr(n, [&random] { return random.uniform() < 0.5 ? -1.0 : 1.0; });
  return q * signs.asDiagonal() * q.transpose();
}

inline Matrix positive_semidefinite(int n, std::uint64_t seed) {
  const Matrix a = gaussian(n, seed);
  return a * a.transpose() / n;
}

inline Matrix positive(int n, std::uint64_t seed) {
  Random random(seed);
  return Matrix::NullaryExpr(n, n, [&random] { return random.uniform(); });
}

/// Pixels in random pairs that see each other.
inline Matrix pairs(int n, std::uint64_t seed) {
  std::vector<int> order(n);
  for (int i = 0; i < n; ++i) order[i] = i;
  Random random(seed);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.bits() % i]);
  Matrix t = Matrix::Zero(n, n);
  for (std::size_t i = 0; i + 1 < order.size(); i += 2)
    t(order[i], order[i + 1]) = t(order[i + 1], order[i]) = 1;
  return t;
}

/// The two colours of a checkerboard weigh the same in every block.
inline DenseTransport checkerboard(int side) {
  const auto colour = [side](int i) { return (i / side + i % side) % 2; };
  return {Grid{side, side}, [=](int i, int j) { return colour(i) == colour(j) ? 0.02 : 0.0; }};
}

struct Outcome {
  CaptureResult result;
  double error = 0;
};

inline Outcome run(const DenseTransport& scene, const CaptureOptions& options = {}, double sigma = 0) {
  DenseProbe probe(scene, sigma);
  CaptureOptions counted = options;
  std::int64_t aside = 0;
  counted.look_aside = [&](std::span<const Pattern> patterns, std::span<const Expectation>) {
    aside += std::ssize(patterns);
    return probe.measure(patterns);
  };
  auto result = capture(probe, counted);
  EXPECT_TRUE(result.ok()) << result.error().line();
  EXPECT_EQ(result->patterns + aside, probe.cost().photographs);
  // Five at the end of a search that found nothing to rely on, where no budget is in the way. A large error
  // is a reason for more.
  const bool looked =
      result->undetermined && !options.unchecked && options.max_patterns == 0 && options.max_seconds == 0;
  constexpr double kLarge = 0.04;
  if (result->stated_error().value_or(0) <= kLarge)
    EXPECT_EQ(aside, looked ? 5 : 0);
  else
    EXPECT_LE(aside, result->patterns);
  const double error = evaluate(result->tensor, scene.truth())->frobenius;
  return {*std::move(result), error};
}

}  // namespace symrig::tests
