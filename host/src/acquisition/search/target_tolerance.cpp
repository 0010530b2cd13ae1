// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/target_tolerance.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::acquisition {
namespace {

/// Error and uncertainty of a capture as a multiple of its tolerance.
constexpr double kErrorPerTolerance = 8;
/// Beyond 25 times the usual tolerance, tests take wrong leaves for right ones.
constexpr int kCoarsestSteps = 8;
/// Fewer save less than a search that ends above its target costs.
constexpr int kFewestSteps = 3;
/// Error grows with this power of the tolerance, or faster.
constexpr double kErrorPower = 0.7;
/// After leaves that were wrong: what the error was is not known.
constexpr int kStepsAfterWrongLeaves = 4;

int steps_of(double factor) {
  return static_cast<int>(std::floor(std::log(factor) / std::log(Coarseness{1}.factor())));
}

Coarseness worthwhile(int steps) {
  return {steps < kFewestSteps ? 0 : std::min(steps, kCoarsestSteps)};
}

}  // namespace

TargetTolerance::TargetTolerance(const CaptureSettings& options) : target_(options.target_error) {
  if (options.keeps_tolerance || !(target_ > 0)) return;
  const double finest = options.rule.flood_fraction;
  now_ = worthwhile(steps_of(target_ / (kErrorPerTolerance * finest)));
}

bool TargetTolerance::reached(const CaptureResult& ended) const {
  return target_ > 0 && ended.stated_error() && *ended.stated_error() <= target_;
}

bool TargetTolerance::search_again(const CaptureResult& ended) {
  if (now_.steps == 0 || ended.stopped_by != "done" || reached(ended)) return false;
  int finer = kStepsAfterWrongLeaves;
  if (const auto error = ended.stated_error(); error && !ended.undetermined) {
    if (!std::isfinite(*error)) return false;  // no light to be seen: no tolerance changes that
    finer = 1 - steps_of(std::pow(target_ / *error, 1 / kErrorPower));
  }
  now_ = worthwhile(now_.steps - finer);
  return true;
}

}  // namespace symrig::acquisition
