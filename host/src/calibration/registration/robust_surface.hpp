// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/registration/spline_surface.hpp"

#include <optional>

namespace symrig::calibration {

/// What a robust fit found.
struct RobustFit {
  double sigma = 1;     ///< of the values, in units of what their weights say
  double left_out = 0;  ///< share of the values that do not count
};

/// Fits a surface robustly, with the weights of Tukey's biweight after each of `rounds` fits: values far from
/// it count less, and those beyond 4.7 robust sigmas not at all. least_sigma: the robust sigma is no smaller,
/// in units of what the weights say. Nothing if a fit fails.
std::optional<RobustFit> fit_robustly(SplineSurface& surface, std::span<const SeenValue> values,
                                      double smoothing, int rounds, double least_sigma = 1e-9);

}  // namespace symrig::calibration
