// SPDX-License-Identifier: Apache-2.0
#include "hdr/dark_level.hpp"

#include "hdr/sensor_parts.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::hdr {

DarkLevel::DarkLevel(Grid grid)
    : sums_(static_cast<std::size_t>(grid.size())), squares_(sums_.size()), defects_(sums_.size()) {}

void DarkLevel::add(Codes codes) {
  std::uint64_t all = 0;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const std::uint32_t code = codes[i];
    sums_[i] += code;
    squares_[i] += std::uint64_t{code} * code;
    all += code;
  }
  means_.push_back(static_cast<double>(all) / static_cast<double>(sums_.size()));
}

double DarkLevel::mean() const {
  double sum = 0;
  for (const double one : means_) sum += one;
  return sum / frames();
}

double DarkLevel::variance_of_mean() const {
  const double middle = mean();
  double squares = 0;
  for (const double one : means_) squares += (one - middle) * (one - middle);
  return squares / (frames() - 1);
}

PixelMoments DarkLevel::moments() const {
  PixelMoments result{std::vector<double>(sums_.size()), std::vector<double>(sums_.size())};
  const double n = frames();
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const auto sum = static_cast<double>(sums_[i]);
    result.mean[i] = sum / n;
    result.variance[i] = std::max(0.0, (static_cast<double>(squares_[i]) - sum * sum / n) / (n - 1));
  }
  return result;
}

/// Least squares: mean code = constant + share · light, over the pixels without defects.
void DarkLevel::subtract_light(std::vector<double>& means, std::span<const double> light,
                               double saturated) const {
  const auto used = [&](std::size_t i) { return defects_[i] == 0 && light[i] < saturated; };
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < means.size(); ++i) {
    if (!used(i)) continue;
    n += 1;
    x += light[i];
    y += means[i];
  }
  if (n < 2) return;
  for (std::size_t i = 0; i < means.size(); ++i) {
    if (!used(i)) continue;
    xx += (light[i] - x / n) * (light[i] - x / n);
    xy += (light[i] - x / n) * (means[i] - y / n);
  }
  const double share = xx > 0 ? std::max(0.0, xy / xx) : 0;
  for (std::size_t i = 0; i < means.size(); ++i) means[i] -= share * (light[i] - x / n);
}

void DarkLevel::finish(std::span<const double> light, double saturated) {
  const PixelMoments all = moments();
  const std::size_t count = means_.size();
  // The second time without the defects of the first.
  PixelMoments own;
  for (int round = 0; round < 2; ++round) {
    own = all;
    subtract_light(own.mean, light, saturated);
    std::ranges::fill(defects_, std::uint8_t{0});
    find_hot(own, count, defects_);
  }
  pedestal_ = mean_of(all.mean, defects_);
  dsnu_ = dsnu_of(own, defects_, count);
  const auto good = static_cast<double>(std::ranges::count(defects_, std::uint8_t{0}));
  // What all pixels of a frame share is no noise of a pixel.
  variance_ = std::max(mean_of(all.variance, defects_) - variance_of_mean(), 1e-6);
  samples_ = good * (frames() - 1);
}

}  // namespace symrig::hdr
