// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/light/light_series.hpp"

#include <algorithm>
#include <array>
#include <cstddef>

namespace symrig::acquisition {

/// The mean of values, and how well it is known from their scatter.
struct LightMean {
  double count = 0, sum = 0, squares = 0;

  void add(double value) { count += 1, sum += value, squares += value * value; }
  double mean() const { return count > 0 ? sum / count : 0; }
  double variance_of_mean() const {
    return count > 1 ? std::max(0.0, squares / count - mean() * mean()) / (count - 1) : 0;
  }
};

/// The light of each photograph as a whole.
class LightSums {
 public:
  explicit LightSums(const LightSeries& series);

  /// Of the light of the flood-lit photograph.
  double share(std::size_t k) const { return light_[k].value / light_[LightSeries::kFlood].value; }
  /// Of the pixels.
  double share_lit(std::size_t k) const { return lit_[k]; }
  /// The relative difference between the brightest photograph and the darkest one.
  double spread() const;
  /// The rms difference between the photographs of the two halves, over their noise.
  double changed() const { return changed_; }

 private:
  std::array<LightSeries::Sum, LightSeries::kCount> light_;
  std::array<double, LightSeries::kCount> lit_{};
  double changed_ = 0;
};

}  // namespace symrig::acquisition
