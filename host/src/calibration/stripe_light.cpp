// SPDX-License-Identifier: Apache-2.0
#include "calibration/stripe_light.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// An edge of the stripes: contrast jumps by `step` at `position`.
struct Edge {
  double position, step;
};

/// Edges of a pattern minus its complement, with 0 outside both borders.
std::vector<Edge> edges_of(std::span<const float> stripes) {
  std::vector<Edge> edges;
  double before = 0;
  for (std::size_t x = 0; x <= stripes.size(); ++x) {
    const double here = x < stripes.size() ? 2 * static_cast<double>(stripes[x]) - 1 : 0;
    if (here != before) edges.push_back({static_cast<double>(x) - 0.5, here - before});
    before = here;
  }
  return edges;
}

/// A Gaussian convolved with a step function: Σ steps · Φ((x − edge) / σ), evaluated from left to right.
/// Edges further than five sigmas left of x count fully.
class BlurredStair {
 public:
  BlurredStair(const std::vector<Edge>& edges, double sigma) : edges_(edges), sigma_(sigma) {}

  double operator()(double x) {
    const double reach = 5 * sigma_;
    for (; passed_ < edges_.size() && edges_[passed_].position < x - reach; ++passed_)
      level_ += edges_[passed_].step;
    double value = level_;
    for (std::size_t i = passed_; i < edges_.size() && edges_[i].position <= x + reach; ++i)
      value += edges_[i].step * 0.5 * std::erfc((edges_[i].position - x) / (sigma_ * std::numbers::sqrt2));
    return value;
  }

 private:
  const std::vector<Edge>& edges_;
  double sigma_;
  std::size_t passed_ = 0;  ///< edges more than five sigmas left of x
  double level_ = 0;        ///< the sum of their steps
};

}  // namespace

StripeLight::StripeLight(const GrayCode& code, StripeAxis axis)
    : bits_(code.bits(axis)),
      size_(axis == StripeAxis::columns ? code.projector().cols : code.projector().rows),
      table_(static_cast<std::size_t>(size_) * static_cast<std::size_t>(bits_) * kScales.size()) {
  const int first = axis == StripeAxis::columns ? 0 : code.column_bits();
  tbb::parallel_for(0, bits_, [&](int bit) {
    std::vector<float> stripes;
    stripes.reserve(size_);
    for (int x = 0; x < size_; ++x) stripes.push_back(code.lit(first + bit, x) ? 1.0F : 0.0F);
    fill(stripes, bit);
  });
}

void StripeLight::fill(std::span<const float> stripes, int bit) {
  const auto edges = edges_of(stripes);
  for (std::size_t s = 0; s < kScales.size(); ++s) {
    BlurredStair blurred(edges, kScales[s]);
    for (int pixel = 0; pixel < size_; ++pixel)
      for (int step = 0; step < kSteps; ++step)
        table_[offset(pixel, bit) + s][step] =
            static_cast<float>(blurred(pixel + static_cast<double>(step) / kSteps));
  }
}

Shape StripeLight::contrasts(double x, int bit) const {
  const double at_step = std::clamp(x * kSteps, 0.0, static_cast<double>(positions() - 1));
  const int index = std::min(static_cast<int>(at_step), positions() - 2);
  const auto share = static_cast<float>(at_step - index);
  const Steps* const low = table_.data() + offset(index / kSteps, bit);
  const Steps* const high = table_.data() + offset((index + 1) / kSteps, bit);
  const auto i = static_cast<std::size_t>(index % kSteps), j = static_cast<std::size_t>((index + 1) % kSteps);
  Shape out{};
  for (std::size_t s = 0; s < kScales.size(); ++s) out[s] = low[s][i] + share * (high[s][j] - low[s][i]);
  return out;
}

}  // namespace symrig::calibration
