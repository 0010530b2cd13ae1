// SPDX-License-Identifier: Apache-2.0
#include "hdr/scene_pixels.hpp"

#include "hdr/sensor_statistics.hpp"

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

namespace {

// Within a group, noise differs by at most √1.25: 6 sigmas of one pixel are 5.4 of another.
constexpr double kStep = 1.25;
constexpr double kDark = 3;             // sigmas of dark noise: pixels below it are one group
constexpr std::size_t kLargest = 4096;  // pixels in a part
constexpr std::size_t kSmallest = 64;
constexpr std::size_t kMostCodes = 65'536;
constexpr double kMargin = 6;  // sigmas of dark noise below saturation
constexpr std::uint8_t kLeftOut = 255, kSaturated = 254;

std::uint8_t group_of(double light, double noise) {
  const double floor = kDark * noise;
  if (light < floor) return 0;
  return static_cast<std::uint8_t>(
      std::min(253.0, 1 + std::floor(std::log(light / floor) / std::log(kStep))));
}

double least_light(std::uint8_t group, double noise) {
  return group == 0 ? 0 : kDark * noise * std::pow(kStep, group - 1);
}

}  // namespace

LightGroups::LightGroups(Codes a, Codes b, std::span<const std::uint8_t> defects, const CodeRange& range)
    : range_(range) {
  const double saturated = range.largest - kMargin * range.noise;
  std::vector<std::uint8_t> groups(a.size());
  std::vector<std::size_t> first(257);
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double light = (a[i] + b[i]) / 2.0 - range.pedestal;
    groups[i] = defects[i] != 0                     ? kLeftOut
                : std::max(a[i], b[i]) >= saturated ? kSaturated
                                                    : group_of(light, range.noise);
    ++first[groups[i] + std::size_t{1}];
  }
  for (std::size_t g = 1; g < first.size(); ++g) first[g] += first[g - 1];
  order_.resize(first[kLeftOut]);
  std::vector<std::size_t> next = first;
  for (std::size_t i = 0; i < a.size(); ++i)
    if (groups[i] != kLeftOut) order_[next[groups[i]]++] = static_cast<std::uint32_t>(i);
  saturated_ = first[kSaturated];
  for (std::size_t g = 0; g < kSaturated; ++g)
    divide(first[g], first[g + 1], least_light(static_cast<std::uint8_t>(g), range.noise));
}

void LightGroups::divide(std::size_t begin, std::size_t end, double light) {
  const std::size_t size = end - begin;
  if (size < kSmallest) return;
  const std::size_t count = (size + kLargest - 1) / kLargest;
  for (std::size_t k = 0; k < count; ++k)
    parts_.push_back({begin + size * k / count, begin + size * (k + 1) / count, light});
}

void LightGroups::add_points(Codes a, Codes b, std::vector<GroupPoint>& points) const {
  std::vector<double> first, second;
  for (const Part& part : parts_) {
    first.clear();
    second.clear();
    int largest = 0;
    for (std::size_t k = part.begin; k < part.end; ++k) {
      const std::size_t i = order_[k];
      largest = std::max({largest, int{a[i]}, int{b[i]}});
      first.push_back(a[i] - range_.pedestal);
      second.push_back(b[i] - range_.pedestal);
    }
    if (largest >= range_.largest) continue;
    const TransferPoint point = transfer_point(first, second);
    if (point.samples >= static_cast<double>(kSmallest) / 2) points.push_back({point, largest});
  }
}

std::vector<double> LightGroups::codes_of(Codes codes, double least) const {
  std::size_t begin = saturated_;
  for (const Part& part : parts_)
    if (part.light >= least) begin = std::min(begin, part.begin);
  const std::size_t step = 1 + (order_.size() - begin) / kMostCodes;
  std::vector<double> found;
  for (std::size_t k = begin; k < order_.size(); k += step) found.push_back(codes[order_[k]]);
  return found;
}

std::pair<double, double> LightGroups::light_of(Codes a, Codes b, double most) const {
  std::pair<double, double> sums;
  for (const Part& part : parts_) {
    if (part.light <= kDark * range_.noise || part.light * kStep > most) continue;
    for (std::size_t k = part.begin; k < part.end; ++k) {
      sums.first += a[order_[k]] - range_.pedestal;
      sums.second += b[order_[k]] - range_.pedestal;
    }
  }
  return sums;
}

}  // namespace symrig::hdr
