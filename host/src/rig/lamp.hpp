// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/radiance.hpp"
#include "symrig/rig/rig.hpp"

#include <cstdint>
#include <deque>
#include <optional>

namespace symrig {

/// Follows the lamp by flood-lit reference photographs. The level of reference k is y_k = Σ F_k / Σ F_0 over
/// the pixels that are valid in both, Var[y_k] = Σ Var[F_k] / (Σ F_0)². Between references the level is a
/// straight line through the last eight of them, weighted by their variances, whose slope is taken from 0 ±
/// `drift`: a lamp that holds still is not made to flicker by the noise of two references. A reference 5
/// sigmas off the line is a lamp that jumped: the line begins anew.
class LampLog {
 public:
  /// every: photographs from one reference to the next while the lamp drifts, 0 = no references; up to eight
  /// times as many while it does not. drift: its relative change over 1,000 photographs, one sigma, before
  /// anything is known.
  LampLog(int every, double drift) : every_(every), drift_(drift), interval_(every) {}

  /// Photographs that may still be taken before the next reference; 0 = it is due.
  std::int64_t until_due(std::int64_t shown) const;
  /// shown: photographs shown before this one, references included. False if the lamp went out: there is no
  /// light above 5 sigmas where the first reference had some.
  bool observe(std::int64_t shown, const Radiance& flood);
  /// 1 before the second reference. The line is not trusted to foretell a change by more than a tenth.
  LampLevel level_at(std::int64_t shown) const;

 private:
  struct Reading {
    double shown, level, variance;
  };
  struct Line {
    double level = 1, slope = 0;  // at the last reading, and a photograph
    double var_level = 0, cov = 0, var_slope = 0;
  };
  bool jumped(const Reading& reading) const;
  Reading compare(std::int64_t shown, const Radiance& flood) const;
  void fit();
  void space_out();

  int every_;
  double drift_;
  std::int64_t interval_;
  std::int64_t last_ = 0;
  std::optional<Radiance> first_;  // F_0
  std::deque<Reading> readings_;
  Line line_;
};

}  // namespace symrig
