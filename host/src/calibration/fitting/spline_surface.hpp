// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/outline.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig::calibration {

/// A value that was seen at a point of a picture.
struct SeenValue {
  Point at;
  double value = 0;
  double weight = 1;  ///< 1 / variance
};

/// A smooth function over a picture: bicubic B-splines on equal intervals [Eilers96]. It continues beyond the
/// border of the picture for half an interval.
class SplineSurface {
 public:
  /// intervals: along the longer side of the picture.
  SplineSurface(Grid picture, int intervals);

  double operator()(Point at) const;
  int intervals() const { return intervals_; }
  /// By rows.
  std::span<const double> coefficients() const { return coefficient_; }
  std::span<double> coefficients() { return coefficient_; }
  /// The surface nearest to the values: min Σ weight (f − value)² + smoothing · Σ weight / coefficients · Σ
  /// (fourth differences of the coefficients)². A cubic polynomial has no fourth differences, so it costs
  /// nothing: the map of a turned lens with radial distortion of third order is found without bias. Returns
  /// false, and leaves the surface as it is, if there are too few values.
  bool fit(std::span<const SeenValue> values, double smoothing);

 private:
  static constexpr int kOrder = 4;  // coefficients that a point depends on, along an axis
  struct Weights {
    int first;
    std::array<double, kOrder> weight;
  };
  static Weights weights_at(double at, double interval, int intervals);
  class NormalEquations;
  std::size_t index(int row, int col) const {
    return static_cast<std::size_t>(std::int64_t{row} * cols_ + col);
  }

  int intervals_;
  double interval_;
  int rows_, cols_;  // coefficients
  std::vector<double> coefficient_;
};

/// What a robust fit found.
struct RobustFit {
  double sigma = 1;     ///< of the values, in units of what their weights say
  double left_out = 0;  ///< share of the values that do not count
};

/// Fits a surface robustly, with the weights of Tukey's biweight after each of `rounds` fits: values far from
/// it count less, and those beyond 4.7 robust sigmas not at all. least_sigma: the robust sigma is no smaller,
/// in units of what the weights say. guesses: more values, which keep their weights, and say nothing of
/// sigma. Nothing if a fit fails.
std::optional<RobustFit> fit_robustly(SplineSurface& surface, std::span<const SeenValue> values,
                                      double smoothing, int rounds, double least_sigma = 1e-9,
                                      std::span<const SeenValue> guesses = {});

}  // namespace symrig::calibration
