// SPDX-License-Identifier: Apache-2.0

#include "sim/drawn/translucent.hpp"

#include "sim/light/random.hpp"

#include <algorithm>

namespace symrig::sim::drawn {

namespace {

/// The smallest part of the picture that holds all of a body; one point if it is nowhere.
Tile bounds_of(Grid grid, std::span<const float> entrance) {
  int top = grid.rows, left = grid.cols, bottom = -1, right = -1;
  for (std::size_t i = 0; i < entrance.size(); ++i) {
    if (entrance[i] == 0) continue;
    const int row = static_cast<int>(i) / grid.cols, col = static_cast<int>(i) % grid.cols;
    top = std::min(top, row), bottom = std::max(bottom, row);
    left = std::min(left, col), right = std::max(right, col);
  }
  return bottom < 0 ? Tile{0, 0, {1, 1}} : Tile{top, left, {bottom - top + 1, right - left + 1}};
}

/// Points far apart are dark in most pictures: mean 1, mean square 16/7.
float speckle_at(std::uint64_t key, std::size_t point) {
  const float u = unit_float(combine(key, point));
  return 4 * u * u * u;
}

}  // namespace

std::vector<std::vector<float>> speckle_pictures(std::uint64_t key, std::size_t points, int count) {
  std::vector<std::vector<float>> pictures(static_cast<std::size_t>(count), std::vector<float>(points));
  for (std::size_t k = 0; k < pictures.size(); ++k)
    for (std::size_t i = 0; i < points; ++i) pictures[k][i] = speckle_at(combine(key, k), i);
  return pictures;
}

Translucent::Translucent(const Translucency& inside, Grid grid, std::span<const float> entrance)
    : Translucent(inside, grid, entrance, bounds_of(grid, entrance)) {}

Translucent::Translucent(const Translucency& inside, Grid grid, std::span<const float> entrance,
                         const Tile& bounds)
    : stride_(static_cast<std::size_t>(grid.cols)),
      first_(static_cast<std::size_t>(bounds.row) * stride_ + static_cast<std::size_t>(bounds.col)),
      part_(bounds.grid),
      near_(static_cast<float>(inside.share * (1 - inside.far_share))),
      far_(static_cast<float>(inside.share * inside.far_share)),
      narrow_(part_, inside.near),
      wide_(part_, inside.far) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(part_.size()); ++i)
    entrance_.push_back(entrance[point(i)]);
  if (inside.speckle != 0) speckles_ = speckle_pictures(inside.speckle, entrance_.size(), kSpeckles);
}

void Translucent::add(float weight, std::span<const float> x, std::span<float> y) const {
  const std::size_t n = entrance_.size();
  std::vector<float> entered(n), left(n, 0.F), bright(n), blurred(n);
  for (std::size_t i = 0; i < n; ++i) entered[i] = entrance_[i] * x[point(i)];
  narrow_.add(near_, entered, left);
  if (speckles_.empty()) wide_.add(far_, entered, left);
  for (const std::vector<float>& speckle : speckles_) {
    std::fill(blurred.begin(), blurred.end(), 0.F);
    for (std::size_t i = 0; i < n; ++i) bright[i] = speckle[i] * entered[i];
    wide_.add(far_ / kSpeckles, bright, blurred);
    for (std::size_t i = 0; i < n; ++i) left[i] += speckle[i] * blurred[i];
  }
  for (std::size_t i = 0; i < n; ++i) y[point(i)] += weight * entrance_[i] * left[i];
}

Haze::Haze(double share, std::uint64_t key, std::span<const float> albedo)
    : share_(static_cast<float>(share / kSpeckles / static_cast<double>(albedo.size()))),
      pictures_(speckle_pictures(key, albedo.size(), kSpeckles)) {
  for (std::vector<float>& picture : pictures_)
    for (std::size_t i = 0; i < picture.size(); ++i) picture[i] *= albedo[i];
}

void Haze::add(float weight, std::span<const float> x, std::span<float> y) const {
  for (const std::vector<float>& picture : pictures_) {
    double sum = 0;
    for (std::size_t i = 0; i < picture.size(); ++i) sum += static_cast<double>(picture[i] * x[i]);
    const float light = weight * share_ * static_cast<float>(sum);
    for (std::size_t i = 0; i < picture.size(); ++i) y[i] += light * picture[i];
  }
}

}  // namespace symrig::sim::drawn
