// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/registered_probe.hpp"

#include "symrig/base/stopwatch.hpp"

namespace symrig {

Result<std::vector<Radiance>> RegisteredProbe::gather(const Result<std::vector<Radiance>>& photographs) {
  if (!photographs) return photographs.error();
  const Stopwatch watch;
  std::vector<Radiance> cells;
  cells.reserve(photographs->size());
  for (const Radiance& photograph : *photographs) {
    SYMRIG_TRY(auto one, weights_.gather(photograph));
    cells.push_back(std::move(one));
  }
  gather_seconds_ += watch.seconds();
  return cells;
}

Result<std::vector<Radiance>> RegisteredProbe::measure(std::span<const Pattern> patterns) {
  return gather(rig_.measure(patterns));
}

Result<std::vector<Radiance>> RegisteredProbe::measure_expected(std::span<const Pattern> patterns,
                                                                std::span<const Expectation> expected) {
  std::vector<Expectation> of_pixels(expected.begin(), expected.end());
  for (Expectation& one : of_pixels)
    for (ExpectedPart& part : one.parts) part.noise /= weights_.noise_share();
  return gather(rig_.measure_expected(patterns, of_pixels));
}

ProbeCost RegisteredProbe::cost() const {
  ProbeCost cost = rig_.cost();
  cost.merge_seconds += gather_seconds_;
  return cost;
}

}  // namespace symrig
