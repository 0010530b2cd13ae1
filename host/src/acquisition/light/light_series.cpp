// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_series.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace symrig::acquisition {

LightSeries::LightSeries(const BlockTree& tree, const TreePhotograph& flood, const Checks* checks)
    : grid_(tree.grid()), valid_(tree.order().size(), 1) {
  constexpr std::array<const char*, Checks::kCount> kNames{"a random half", "the other half", "a random 1/32",
                                                           "another 1/32",  "a bar",          "a picture"};
  add("all pixels", tree, flood);
  if (checks != nullptr)
    for (std::size_t k = 0; k < kNames.size(); ++k) add(kNames[k], tree, checks->photographs()[k].photograph);
  pixels_ = std::ranges::count(valid_, std::uint8_t{1});
}

void LightSeries::add(std::string name, const BlockTree& tree, const TreePhotograph& photograph) {
  const auto order = tree.order();
  const std::size_t pixels = order.size();
  LightPhotograph one{std::move(name), std::vector<std::uint8_t>(pixels), PagedVector<float>(pixels, 0.0F),
                      PagedVector<float>(pixels, 0.0F)};
  for (std::size_t t = 0; t < pixels; ++t) {
    const auto at = static_cast<std::size_t>(order[t]);
    one.lit[at] = photograph.pattern[t] > 0 ? 1 : 0;
    for (std::size_t sample = t; sample < photograph.mean.size(); sample += pixels) {
      one.mean[at] += photograph.mean[sample];
      one.variance[at] += photograph.variance[sample];
      if (photograph.valid[sample] == 0) valid_[at] = 0;
    }
  }
  photographs_.push_back(std::move(one));
}

LightSeries::Sum LightSeries::sum(std::size_t k) const {
  const LightPhotograph& one = photographs_[k];
  double value = 0, variance = 0;
  for (std::size_t at = 0; at < valid_.size(); ++at) {
    if (valid_[at] == 0) continue;
    value += static_cast<double>(one.mean[at]);
    variance += static_cast<double>(one.variance[at]);
  }
  return {value, std::sqrt(variance)};
}

}  // namespace symrig::acquisition
