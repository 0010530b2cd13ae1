// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"
#include "symrig/rig/rig.hpp"

#include <cstdint>
#include <deque>
#include <optional>

namespace symrig {

/// Follows the lamp with flood-lit reference photographs. The level of reference k is y_k = Σ F_k / Σ F_0
/// over the pixels that are valid in both. Var[y_k] = Σ Var[F_k] / (Σ F_0)². Between references the level is
/// a straight line through the last eight of them, weighted by their variances. The prior of its slope is 0 ±
/// `drift`, so that the noise of two references does not look like drift. A reference 5 sigmas off the line
/// means that the lamp jumped: a new line begins.
class LampLog {
 public:
  /// every: photographs between two references while the lamp drifts, up to eight times as many while it is
  /// stable. 0 = no references. drift: prior of the relative change over 1,000 photographs, one sigma.
  LampLog(int every, double drift) : every_(every), drift_(drift), interval_(every) {}

  /// Photographs that may still be taken before the next reference. 0 = the reference is due.
  std::int64_t until_due(std::int64_t shown) const;
  /// shown: photographs before this one, references included. Returns false if the lamp went out: no light
  /// above 5 sigmas, although the first reference had some.
  bool observe(std::int64_t shown, const Radiance& flood);
  /// 1 before the second reference. A predicted change is limited to a tenth.
  LampLevel level_at(std::int64_t shown) const;

 private:
  struct Reading {
    double shown, level, variance;
  };
  struct Line {
    double level = 1, slope = 0;  // level at the last reading; slope per photograph
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
