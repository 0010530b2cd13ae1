// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/stripe_pixels.hpp"

#include "symrig/base/quantile.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// A pixel must see white this many standard deviations above nothing.
constexpr double kBright = 10;
/// And at least this share of its light must follow the stripes. A shadow that other surfaces light has none.
constexpr float kDirect = 0.2F;

}  // namespace

StripePixels::StripePixels(const GrayCode& code, std::span<const Radiance> photographs, int channel)
    : code_(code), photographs_(photographs), channel_(channel) {
  const auto pixels = static_cast<std::size_t>(camera().size());
  direct_.resize(pixels);
  tbb::parallel_for(std::size_t{0}, pixels, [&](std::size_t pixel) { direct_[pixel] = direct_share(pixel); });
}

std::size_t StripePixels::count_good() const {
  return static_cast<std::size_t>(std::ranges::count_if(direct_, [](float share) { return share > 0; }));
}

double StripePixels::ratio(std::size_t pixel, int pair) const {
  const int first = 2 * pair;
  const auto a = static_cast<double>(photographs_[first].mean.plane(channel_)[pixel]);
  const auto b = static_cast<double>(photographs_[first + 1].mean.plane(channel_)[pixel]);
  return a + b > 0 ? (a - b) / (a + b) : 0;
}

/// The share of a pixel's light that changes with the stripes: the median over the pairs of both axes. The
/// few pairs that have an edge in the pixel see less.
float StripePixels::direct_share(std::size_t pixel) const {
  const Radiance& white = photographs_[code_.white()];
  const auto level = static_cast<double>(white.mean.plane(channel_)[pixel]);
  const auto sigma = std::sqrt(static_cast<double>(white.variance.plane(channel_)[pixel]));
  if (!(level > 0) || level < kBright * sigma) return 0;
  for (const Radiance& photograph : photographs_)
    if (!photograph.valid.plane(channel_)[pixel]) return 0;
  std::array<double, 64> shares;
  std::size_t count = 0;
  for (int pair = 0; pair < code_.pairs(); ++pair) shares[count++] = std::abs(ratio(pixel, pair));
  const auto share = static_cast<float>(median(std::span(shares).first(count)));
  return share >= kDirect ? share : 0;
}

double StripePixels::follows_all(std::size_t pixel, StripeAxis axis) const {
  double least = 1, second = 1;
  for (int k = 0; k < code_.bits(axis); ++k) {
    const double share = std::abs(ratio(pixel, first_pair(axis) + k));
    second = std::min(second, std::max(share, least));
    least = std::min(least, share);
  }
  return second;
}

std::vector<SeenValue> StripePixels::decoded(StripeAxis axis) const {
  const Grid grid = camera();
  const int size = this->size(axis);
  const int first = first_pair(axis), bits = code_.bits(axis);
  std::vector<SeenValue> values;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const auto pixel = static_cast<std::size_t>(std::int64_t{row} * grid.cols + col);
      if (!good(pixel)) continue;
      int cell = 0, bit = 0;
      for (int k = 0; k < bits; ++k) {
        bit ^= ratio(pixel, first + k) > 0 ? 1 : 0;
        cell = 2 * cell + bit;
      }
      if (cell < size) values.push_back({{row + 0.5, col + 0.5}, cell + 0.5, 1});
    }
  return values;
}

double StripePixels::finest_contrast(StripeAxis axis) const {
  const int finest = first_pair(axis) + code_.bits(axis) - 1, wider = std::max(finest - 2, first_pair(axis));
  double fine = 0, wide = 0;
  for (std::size_t pixel = 0; pixel < direct_.size(); ++pixel) {
    if (!good(pixel)) continue;
    fine += std::abs(ratio(pixel, finest));
    wide += std::abs(ratio(pixel, wider));
  }
  return wide > 0 ? fine / wide : 0;
}

/// Exactly one bit of a Gray code changes between neighbours.
std::optional<int> StripePixels::pair_at(StripeAxis axis, int border) const {
  const int size = this->size(axis);
  if (border <= 0 || border >= size) return std::nullopt;
  const int first = first_pair(axis);
  for (int k = 0; k < code_.bits(axis); ++k)
    if (code_.lit(first + k, border - 1) != code_.lit(first + k, border)) return first + k;
  return std::nullopt;
}

std::optional<double> StripePixels::balance(std::size_t pixel, StripeAxis axis, int border) const {
  const auto pair = pair_at(axis, border);
  if (!pair || !good(pixel)) return std::nullopt;
  const double sign = code_.lit(*pair, border) ? 1 : -1;
  return sign * ratio(pixel, *pair) / static_cast<double>(direct_[pixel]);
}

double StripePixels::balance_sigma(std::size_t pixel, StripeAxis axis, int border) const {
  const auto pair = pair_at(axis, border);
  if (!pair || !good(pixel)) return 0;
  const int first = 2 * *pair;
  const Radiance &a = photographs_[first], &b = photographs_[first + 1];
  const auto at = [&](const Image<float>& image) {
    return static_cast<double>(image.plane(channel_)[pixel]);
  };
  const double sum = at(a.mean) + at(b.mean);
  return sum > 0 ? std::sqrt(at(a.variance) + at(b.variance)) / sum / static_cast<double>(direct_[pixel]) : 0;
}

}  // namespace symrig::calibration
