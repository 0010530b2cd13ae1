// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/symrig.h"

#include <memory>
#include <span>
#include <string>
#include <vector>

namespace symrig::capi {

/// A rig that is a function of a C program.
class CallbackProbe final : public Probe {
 public:
  /// Reads as many members of `own` as its `size` states.
  /// fails: bad_argument (a member out of its range; a size that no version has), limit (a batch too large).
  static Result<std::unique_ptr<CallbackProbe>> make(const symrig_own_rig& own);

  Grid grid() const override { return grid_; }
  ViewLayout views() const override { return views_; }
  int channels() const override { return channels_; }
  std::size_t together() const override { return together_; }
  ProbeCost cost() const override { return cost_; }
  std::string describe() const override { return name_; }
  /// The callback gets batches of at most together() patterns.
  /// fails: also what the callback returns; bad_value (NaN, infinity, a negative variance, a valid that is
  /// not 0 or 1, negative seconds); fault (it threw an exception).
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;

 private:
  CallbackProbe(const symrig_own_rig& own, Grid grid);
  Result<double> ask(std::span<const Pattern> patterns, std::vector<Radiance>& photographs) const;

  symrig_measure measure_;
  void* user_;
  std::string name_;
  Grid grid_;
  ViewLayout views_;
  int channels_;
  std::size_t together_;
  ProbeCost cost_;
};

}  // namespace symrig::capi
