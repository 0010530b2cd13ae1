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

/// Edges of a pattern less its complement, dark (0) beyond both borders.
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

/// A Gaussian over a stair: Σ steps · Φ((x − edge) / σ). Edges further than five sigmas left of x count
/// whole.
double blurred(const std::vector<Edge>& edges, double x, double sigma) {
  const double reach = 5 * sigma;
  double value = 0;
  for (const Edge& e : edges) {
    if (e.position > x + reach) break;
    value += e.position < x - reach
                 ? e.step
                 : e.step * 0.5 * std::erfc((e.position - x) / (sigma * std::numbers::sqrt2));
  }
  return value;
}

}  // namespace

StripeLight::StripeLight(const GrayCode& code, StripeAxis axis)
    : bits_(code.bits(axis)),
      size_(axis == StripeAxis::columns ? code.projector().cols : code.projector().rows),
      table_(static_cast<std::size_t>(positions()) * static_cast<std::size_t>(bits_) * kScales.size()) {
  const int first = axis == StripeAxis::columns ? 0 : code.column_bits();
  tbb::parallel_for(0, bits_, [&](int bit) {
    std::vector<float> stripes;
    stripes.reserve(static_cast<std::size_t>(size_));
    for (int x = 0; x < size_; ++x) stripes.push_back(code.lit(first + bit, x) ? 1.0F : 0.0F);
    fill(stripes, bit);
  });
}

void StripeLight::fill(std::span<const float> stripes, int bit) {
  const auto edges = edges_of(stripes);
  for (int index = 0; index < positions(); ++index) {
    const auto row = std::span(table_).subspan(offset(index, bit), kScales.size());
    for (std::size_t s = 0; s < kScales.size(); ++s)
      row[s] = static_cast<float>(blurred(edges, static_cast<double>(index) / kSteps, kScales[s]));
  }
}

Bits StripeLight::contrast(int index, const Shape& shape) const {
  Bits all{};
  for (int bit = 0; bit < bits_; ++bit) {
    const float* const row = at(index, bit);
    float sum = 0;
    for (std::size_t s = 0; s < kScales.size(); ++s) sum += shape[s] * row[s];
    all[static_cast<std::size_t>(bit)] = sum;
  }
  return all;
}

Shape StripeLight::contrasts(double x, int bit) const {
  const double at_step = std::clamp(x * kSteps, 0.0, static_cast<double>(positions() - 1));
  const int index = std::min(static_cast<int>(at_step), positions() - 2);
  const auto share = static_cast<float>(at_step - index);
  const float* const low = at(index, bit);
  const float* const high = at(index + 1, bit);
  Shape out{};
  for (std::size_t s = 0; s < kScales.size(); ++s) out[s] = low[s] + share * (high[s] - low[s]);
  return out;
}

}  // namespace symrig::calibration
