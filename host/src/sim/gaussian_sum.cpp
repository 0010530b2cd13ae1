// SPDX-License-Identifier: Apache-2.0
#include "sim/gaussian_sum.hpp"

#include <cmath>

namespace symrig::sim {

namespace {

constexpr double kStep = 0.54;
/// Replacing the tail by one term has an error of (τ u)⁴/72 of 1/u², where τ is the lowest rate kept: 1e-7
/// here.
constexpr double kFirstExponent = 0.05;
/// Dropping higher rates has an error of (1 + x) e^−x with x = τ u: 4e-8 here.
constexpr double kLastExponent = 20;

/// Adds the terms h τ₀² e^{2hk}, k < 0, as one term with their total weight at their mean rate (geometric
/// series).
void add_lower_tail(GaussianSum& sum, double first_rate) {
  const auto series = [](double power) { return std::exp(-power * kStep) / (1 - std::exp(-power * kStep)); };
  const double weight = kStep * first_rate * first_rate * series(2);
  sum.weight.push_back(weight);
  sum.rate.push_back(kStep * std::pow(first_rate, 3) * series(3) / weight);
}

}  // namespace

GaussianSum inverse_square(double lowest, double highest) {
  GaussianSum sum;
  const double first = kFirstExponent / highest;
  add_lower_tail(sum, first);
  const int terms = 1 + static_cast<int>(std::ceil(std::log(kLastExponent / lowest / first) / kStep));
  for (int k = 0; k < terms; ++k) {
    const double rate = first * std::exp(kStep * k);
    sum.weight.push_back(kStep * rate * rate);
    sum.rate.push_back(rate);
  }
  return sum;
}

}  // namespace symrig::sim
