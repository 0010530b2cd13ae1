// SPDX-License-Identifier: Apache-2.0
#include "calibration/photograph_each.hpp"

#include <utility>

#include <fmt/format.h>

namespace symrig::calibration {

Result<std::vector<Radiance>> photograph_each(Probe& probe, std::span<const Pattern> patterns,
                                              const std::string& step, const Progress& progress) {
  std::vector<Radiance> photographs;
  photographs.reserve(patterns.size());
  const auto count = static_cast<std::int64_t>(patterns.size());
  for (std::size_t k = 0; k < patterns.size(); ++k) {
    if (progress && !progress({step, static_cast<std::int64_t>(k), count, kNoneToCome}))
      return Error{ErrorCode::interrupted,
                   fmt::format("calibration stopped at photograph {} of {} ({})", k + 1, count, step),
                   "run it again"};
    SYMRIG_TRY(auto one, probe.measure(patterns.subspan(k, 1)));
    photographs.push_back(std::move(one.front()));
  }
  return photographs;
}

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
