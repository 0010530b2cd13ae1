// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/scaled_sum.hpp"

namespace symrig::calibration {

Radiance scaled_sum(std::span<const Radiance> photographs, float share) {
  Radiance sum = photographs.front();
  for (const Radiance& one : photographs.subspan(1))
    for (std::size_t i = 0; i < sum.mean.values().size(); ++i) {
      sum.mean.values()[i] += one.mean.values()[i];
      sum.variance.values()[i] += one.variance.values()[i];
      sum.valid.values()[i] &= one.valid.values()[i];
    }
  for (std::size_t i = 0; i < sum.mean.values().size(); ++i) {
    const float valid = sum.valid.values()[i] ? share : 0;
    sum.mean.values()[i] *= valid;
    sum.variance.values()[i] *= valid * valid;
  }
  return sum;
}

}  // namespace symrig::calibration
