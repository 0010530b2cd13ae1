// SPDX-License-Identifier: Apache-2.0
#include "calibration/pixel_map/stripe_light.hpp"

#include "calibration/fitting/least_squares.hpp"
#include "calibration/pixel_map/stripe_search.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// An edge of the stripes: contrast jumps by `step` at `position` [1 / kSteps pixel].
struct Edge {
  int position;
  double step;
};

/// Edges of a pattern minus its complement, with 0 outside both borders.
std::vector<Edge> edges_of(std::span<const float> stripes) {
  static_assert(kSteps % 2 == 0, "an edge between two pixels is a whole number of steps");
  std::vector<Edge> edges;
  double before = 0;
  for (std::size_t x = 0; x <= stripes.size(); ++x) {
    const double here = x < stripes.size() ? 2 * static_cast<double>(stripes[x]) - 1 : 0;
    if (here != before) edges.push_back({static_cast<int>(x) * kSteps - kSteps / 2, here - before});
    before = here;
  }
  return edges;
}

/// Φ(x / σ) at whole steps: edges and positions are whole steps, so no other value is needed.
class BlurredStep {
 public:
  explicit BlurredStep(double sigma) : reach_(static_cast<int>(5 * sigma * kSteps)) {
    for (int x = -reach_; x <= reach_; ++x)
      value_.push_back(0.5 * std::erfc(-static_cast<double>(x) / kSteps / (sigma * std::numbers::sqrt2)));
  }
  /// Five sigmas [steps]. Beyond them it is 0 or 1.
  int reach() const { return reach_; }
  /// −reach <= x <= reach
  double operator()(int x) const { return value_[x + reach_]; }

 private:
  int reach_;
  std::vector<double> value_;
};

/// A Gaussian convolved with a step function: Σ steps · Φ((x − edge) / σ), evaluated from left to right.
class BlurredStair {
 public:
  BlurredStair(const std::vector<Edge>& edges, const BlurredStep& blurred)
      : edges_(edges), blurred_(blurred) {}

  double operator()(int x) {
    const int reach = blurred_.reach();
    for (; passed_ < edges_.size() && edges_[passed_].position < x - reach; ++passed_)
      level_ += edges_[passed_].step;
    double value = level_;
    for (std::size_t i = passed_; i < edges_.size() && edges_[i].position <= x + reach; ++i)
      value += edges_[i].step * blurred_(x - edges_[i].position);
    return value;
  }

 private:
  const std::vector<Edge>& edges_;
  const BlurredStep& blurred_;
  std::size_t passed_ = 0;  ///< edges that are left of the reach
  double level_ = 0;        ///< the sum of their steps
};

}  // namespace

StripeLight::StripeLight(const GrayCode& code, StripeAxis axis)
    : bits_(code.bits(axis)),
      size_(axis == StripeAxis::columns ? code.projector().cols : code.projector().rows),
      table_(static_cast<std::size_t>(size_) * static_cast<std::size_t>(bits_) * kScales.size()),
      scales_(static_cast<std::size_t>(size_) * kSteps * static_cast<std::size_t>(bits_)) {
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
    const BlurredStep step_function(kScales[s]);
    BlurredStair blurred(edges, step_function);
    for (int pixel = 0; pixel < size_; ++pixel)
      for (int step = 0; step < kSteps; ++step)
        scales_[(pixel * kSteps + step) * bits_ + bit][s] = table_[offset(pixel, bit) + s][step] =
            static_cast<float>(blurred(pixel * kSteps + step));
  }
}

void StripeLight::contrasts(double x, ScaleLanes* to) const {
  const double at_step = std::clamp(x * kSteps, 0.0, static_cast<double>(positions() - 1));
  const int index = std::min(static_cast<int>(at_step), positions() - 2);
  const auto share = static_cast<float>(at_step - index);
  const ScaleLanes* const low = scales_.data() + static_cast<std::size_t>(index) * bits_;
  const ScaleLanes* const high = low + bits_;
  for (int bit = 0; bit < bits_; ++bit)
    for (std::size_t s = 0; s < to->size(); ++s)
      to[bit][s] = low[bit][s] + share * (high[bit][s] - low[bit][s]);
}

void ShapeFit::add(const StripeLight& light, std::optional<int> left_out, double position,
                   const Differences& seen, float contrast) {
  // One pixel has few terms, so floats keep enough digits.
  std::array<ScaleLanes, kMaxBits> m;
  light.contrasts(position, m.data());
  Bits d;
  int terms = 0;
  for (int bit = 0; bit < light.bits(); ++bit) {
    if (bit == left_out) continue;
    m[terms] = m[bit];
    d[terms++] = seen.value[bit] / contrast;
  }
  ShapeSums sums;
  sum_shape(m.data(), d.data(), terms, contrast * contrast / seen.variance, sums);
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j < kSize; ++j) a_[i][j] += static_cast<double>(sums.a[i][j]);
    b_[i] += static_cast<double>(sums.b[i]);
  }
  pixels_ += 1;
}

ShapeFit& ShapeFit::operator+=(const ShapeFit& other) {
  for (std::size_t i = 0; i < kSize; ++i) {
    for (std::size_t j = 0; j < kSize; ++j) a_[i][j] += other.a_[i][j];
    b_[i] += other.b_[i];
  }
  pixels_ += other.pixels_;
  return *this;
}

double ShapeFit::information() const {
  double trace = 0;
  for (std::size_t i = 0; i < kSize; ++i) trace += a_[i][i];
  return pixels_ > 0 ? trace / static_cast<double>(kSize) / pixels_ : 0;
}

Shape ShapeFit::solve(const Shape& usual, double pull) const {
  if (pixels_ == 0) return usual;
  // The prior adds pull · (x − usual)². The usual shape is also a near starting point.
  Vector b = b_;
  NonNegative<kSize>::Point from;
  for (std::size_t i = 0; i < kSize; ++i) {
    from.x[i] = static_cast<double>(usual[i]);
    if (usual[i] > 0) from.active |= 1U << i;
    b[i] += pull * from.x[i];
  }
  const NonNegative<kSize> solver(a_, b, pull);
  const Vector x = solver.minimum(NonNegative<kSize>::kAll, from).x;
  Shape shape{};
  std::ranges::transform(x, shape.begin(), [](double share) { return static_cast<float>(share); });
  return shape;
}

}  // namespace symrig::calibration
