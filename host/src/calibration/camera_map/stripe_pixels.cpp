// SPDX-License-Identifier: Apache-2.0
#include "calibration/camera_map/stripe_pixels.hpp"

#include "symrig/base/statistics.hpp"
#include "symrig/calibration/cell_weights.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <tbb/parallel_for.h>

namespace symrig::calibration {
namespace {

/// A pixel must see white this many standard deviations above nothing.
constexpr double kBright = 10;
/// And at least this share of its light must follow all stripes. A shadow, and a surface beside the picture,
/// are lit by other surfaces: by the half that a wide stripe lights, and by all fine stripes alike.
constexpr double kDirect = 0.2;

/// Of the median light of those pixels. A ghost beside the picture follows all stripes, too, and has less.
constexpr double kFaint = 0.03;

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
  const double follows =
      std::min(follows_all(pixel, StripeAxis::rows), follows_all(pixel, StripeAxis::columns));
  return std::min(static_cast<double>(share), follows) >= kDirect ? share : 0;
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
  const auto light = photographs_[code_.white()].mean.plane(channel_);
  std::vector<float> lights;
  for (std::size_t pixel = 0; pixel < direct_.size(); ++pixel)
    if (good(pixel)) lights.push_back(light[pixel]);
  if (lights.empty()) return {};
  const double least = kFaint * static_cast<double>(median(lights));
  std::vector<SeenValue> values;
  for (int row = 0; row < grid.rows; ++row)
    for (int col = 0; col < grid.cols; ++col) {
      const auto pixel = static_cast<std::size_t>(std::int64_t{row} * grid.cols + col);
      if (!good(pixel) || static_cast<double>(light[pixel]) < least) continue;
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

namespace {

/// [cells] A neighbour that sees one cell only is not farther from the border. Stripes are two cells wide.
constexpr double kFarthest = 1.5;
/// The neighbours on both sides of the border must differ by this much, of at most 2.
constexpr double kLeastContrast = 0.3;

}  // namespace

BorderPixels::PointOnAxis BorderPixels::place(Point at) const {
  const double here = surface_(at);
  const double width = std::abs(surface_({at.row + 0.5, at.col}) - surface_({at.row - 0.5, at.col})) +
                       std::abs(surface_({at.row, at.col + 0.5}) - surface_({at.row, at.col - 0.5}));
  return {here, width, static_cast<int>(std::lround(here))};
}

/// The nearest pixel in a direction that does not see the border.
std::optional<std::size_t> BorderPixels::clear_neighbour(int row, int col, bool by_rows, int step,
                                                         const PointOnAxis& border) const {
  for (int k = 1;; ++k) {
    const int r = row + (by_rows ? k * step : 0), c = col + (by_rows ? 0 : k * step);
    if (r < 0 || c < 0 || r >= camera_.rows || c >= camera_.cols) return std::nullopt;
    const double off = std::abs(surface_({r + 0.5, c + 0.5}) - border.border);
    if (off > kFarthest) return std::nullopt;
    if (off < 0.5 * border.width + 2 * blur_) continue;
    return pixels_.good(index(r, c)) ? std::optional(index(r, c)) : std::nullopt;
  }
}

std::optional<BorderPixels::Balance> BorderPixels::balance(int row, int col,
                                                           const PointOnAxis& border) const {
  const double middle_row = row + 0.5, middle_col = col + 0.5;
  const double down = surface_({middle_row + 0.5, middle_col}) - surface_({middle_row - 0.5, middle_col});
  const double right = surface_({middle_row, middle_col + 0.5}) - surface_({middle_row, middle_col - 0.5});
  // One pixel towards the second cell.
  const bool by_rows = std::abs(down) >= std::abs(right);
  const int forward = (by_rows ? down : right) > 0 ? 1 : -1;
  const auto first = clear_neighbour(row, col, by_rows, -forward, border);
  const auto second = clear_neighbour(row, col, by_rows, forward, border);
  if (!first || !second) return std::nullopt;
  const auto of = [&](std::size_t pixel) { return pixels_.balance(pixel, axis_, border.border); };
  const auto sigma_of = [&](std::size_t pixel) { return pixels_.balance_sigma(pixel, axis_, border.border); };
  const auto here = of(index(row, col)), near = of(*first), far = of(*second);
  if (!here || !near || !far || *far - *near < kLeastContrast) return std::nullopt;
  const double share = (*far - *here) / (*far - *near);
  const double sigma =
      std::hypot(sigma_of(index(row, col)), share * sigma_of(*first), (1 - share) * sigma_of(*second));
  return Balance{1 - 2 * share, 2 * sigma / (*far - *near), *here, 0.5 * (*far - *near)};
}

float BorderPixels::share(int row, int col) const {
  const PointOnAxis here = place({row + 0.5, col + 0.5});
  if (!here.crossed() || here.border <= 0 || here.border >= pixels_.size(axis_)) return 1;
  const auto found = balance(row, col, here);
  if (!found) return kUnknownShare;
  // Light from elsewhere in the scene and light that scatters below the surface do not follow the border:
  // they count by area.
  const double sharp = std::clamp(found->sharp, 0.0, 1.0) * pixels_.follows_all(index(row, col), axis_);
  const double by_light = 0.5 - 0.5 * found->value, by_area = 0.5 + (here.border - here.here) / here.width;
  return static_cast<float>(
      std::clamp(sharp * by_light + (1 - sharp) * std::clamp(by_area, 0.0, 1.0), 0.0, 1.0));
}

void fill_shares(const BorderPixels& borders, Grid camera, std::span<float> shares) {
  tbb::parallel_for(0, camera.rows, [&](int row) {
    for (int col = 0; col < camera.cols; ++col)
      shares[static_cast<std::size_t>(std::int64_t{row} * camera.cols + col)] = borders.share(row, col);
  });
}

}  // namespace symrig::calibration
