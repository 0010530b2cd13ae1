// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/expected_errors.hpp"

namespace symrig {

std::optional<ExpectedIndirect> expected_indirect(const Registration& registration, ViewLayout views) {
  constexpr double kSurfaces = 0.22, kScattering = 1.1;
  if (!views.single() || registration.weighting() != Weighting::cores) return std::nullopt;
  const double pixels = registration.pixels_per_cell();
  return ExpectedIndirect{kSurfaces / pixels, kScattering / (pixels * pixels)};
}

}  // namespace symrig
