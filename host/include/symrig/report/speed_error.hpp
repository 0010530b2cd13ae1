// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace symrig {

/// One capture as a point: what it cost (patterns, or seconds) and the relative error it left.
struct CostError {
  double cost = 0;
  double error = 0;
};

/// How far a reading may be trusted. Nothing is ever extrapolated.
enum class Reach : std::uint8_t {
  read,         ///< between two captures, or at one
  at_most,      ///< the end of the sweep is better than asked for: the true value is this or less
  not_reached,  ///< no capture of the sweep gets there
};

struct Reading {
  Reach reach = Reach::not_reached;
  double value = 0;  ///< 0 where not reached

  bool reached() const { return reach != Reach::not_reached; }
};

/// The captures that no other beats in cost and error at once: rising cost, strictly falling error. A sweep
/// is seldom monotone (a tighter tolerance may take more patterns and still err more); a user would pick from
/// these. Points without a finite cost > 0 and a finite error ≥ 0 are left out.
std::vector<CostError> lower_envelope(std::vector<CostError> captures);

/// Cost at which an envelope comes down to `error`: straight between two captures in log cost over log error.
/// at_most if the cheapest capture errs less already. A capture without any error has no logarithm: between
/// it and its neighbour its own cost is told, as at_most.
Reading cost_at_error(std::span<const CostError> envelope, double error);

/// Error that an envelope leaves at `cost`, the same way: not_reached below the cheapest capture, at_most
/// beyond the costliest.
Reading error_at_cost(std::span<const CostError> envelope, double cost);

/// value / reference. Two exact results (0 / 0) are equally good: 1. Not reached if only the reference is 0.
Reading ratio(const Reading& value, double reference);

/// What it takes to satisfy both: the larger one.
Reading larger(const Reading& a, const Reading& b);

/// Geometric mean of ratios. Those that were not reached, and zeros, are counted instead of averaged: a mean
/// that hides them would flatter.
struct MeanRatio {
  double value = 0;  ///< 0 if there is nothing to average
  int averaged = 0;
  int bounds = 0;       ///< of those averaged, at_most: the true mean is `value` or less
  int not_reached = 0;  ///< left out: it would pull the mean up
  int zero = 0;         ///< left out: it would pull the mean to 0

  Reach reach() const;  ///< not_reached if anything that would pull it up is missing
};
MeanRatio geometric_mean(std::span<const Reading> ratios);

}  // namespace symrig
