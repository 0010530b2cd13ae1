// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// One capture as a point: its cost (patterns or seconds) and its relative error.
struct CostError {
  double cost = 0;
  double error = 0;
};

/// How a reading was obtained. Nothing is extrapolated.
enum class Reach : std::uint8_t {
  read,         ///< interpolated between two captures, or taken from one
  at_most,      ///< the end of the sweep is already better: the true value is this or less
  not_reached,  ///< no capture of the sweep reaches it
};

struct Reading {
  Reach reach = Reach::not_reached;
  double value = 0;  ///< 0 where not reached

  bool reached() const { return reach != Reach::not_reached; }
};

/// The captures that no other capture beats in both cost and error: increasing cost, strictly decreasing
/// error. A sweep is seldom monotonic, because a tighter tolerance may need more patterns and still give a
/// larger error. A user would choose one of these captures. Points without a finite cost > 0 and a finite
/// error ≥ 0 are ignored.
std::vector<CostError> lower_envelope(std::vector<CostError> captures);

/// The cost at which an envelope reaches `error`, by linear interpolation of log cost over log error. at_most
/// if the cheapest capture already has a smaller error. A capture with error 0 has no logarithm: between it
/// and its neighbour the result is its own cost, as at_most.
Reading cost_at_error(std::span<const CostError> envelope, double error);

/// The error of an envelope at `cost`, by the same interpolation: not_reached below the cheapest capture,
/// at_most beyond the most expensive one.
Reading error_at_cost(std::span<const CostError> envelope, double cost);

/// value / reference. Two exact results (0 / 0) are equally good: 1. Not reached if only the reference is 0.
Reading ratio(const Reading& value, double reference);

/// The larger of two readings: the cost that satisfies both.
Reading larger(const Reading& a, const Reading& b);

/// Geometric mean of ratios. Ratios that were not reached, and zeros, are counted instead of averaged, so
/// that the mean does not hide them.
struct MeanRatio {
  double value = 0;  ///< 0 if there is nothing to average
  int averaged = 0;
  int bounds = 0;       ///< averaged ratios that are at_most: the true mean is `value` or less
  int not_reached = 0;  ///< not averaged; they would increase the mean
  int zero = 0;         ///< not averaged; they would make the mean 0

  Reach reach() const;  ///< not_reached if a ratio that would increase the mean is missing
};
MeanRatio geometric_mean(std::span<const Reading> ratios);

}  // namespace symrig
