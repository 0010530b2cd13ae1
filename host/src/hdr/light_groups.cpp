// SPDX-License-Identifier: Apache-2.0
#include "hdr/light_groups.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::hdr {
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
