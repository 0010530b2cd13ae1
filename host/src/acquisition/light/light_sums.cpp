// SPDX-License-Identifier: Apache-2.0
#include "acquisition/light/light_sums.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace symrig::acquisition {

LightSums::LightSums(const LightSeries& series) {
  for (std::size_t k = 0; k < LightSeries::kCount; ++k) {
    light_[k] = series.sum(k);
    const auto lit = std::ranges::count(series[k].lit, std::uint8_t{1});
    lit_[k] = static_cast<double>(lit) / static_cast<double>(series[k].lit.size());
  }
  double squares = 0, noise = 0;
  const LightPhotograph &half = series[LightSeries::kHalf], &other = series[LightSeries::kOtherHalf];
  for (std::size_t at = 0; at < series.valid().size(); ++at) {
    if (series.valid()[at] == 0) continue;
    const double difference = static_cast<double>(half.mean[at]) - static_cast<double>(other.mean[at]);
    squares += difference * difference;
    noise += static_cast<double>(half.variance[at]) + static_cast<double>(other.variance[at]);
  }
  if (squares > 0)
    changed_ = noise > 0 ? std::sqrt(squares / noise) : std::numeric_limits<double>::infinity();
}

double LightSums::spread() const {
  const auto [least, most] =
      std::ranges::minmax_element(light_, {}, [](const LightSeries::Sum& one) { return one.value; });
  return most->value > 0 ? 1 - least->value / most->value : std::numeric_limits<double>::infinity();
}

}  // namespace symrig::acquisition
