// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"

#include <span>
#include <string>
#include <vector>

namespace symrig {

/// A probe in front of another one: it asks that one everything. Derive from it to look at the photographs.
class ForwardingProbe : public Probe {
 public:
  /// inner must outlive this.
  explicit ForwardingProbe(Probe& inner) : inner_(inner) {}

  Grid grid() const override { return inner_.grid(); }
  Grid camera_grid() const override { return inner_.camera_grid(); }
  ViewLayout views() const override { return inner_.views(); }
  int channels() const override { return inner_.channels(); }
  double residual_shift() const override { return inner_.residual_shift(); }
  bool plans_exposures(std::size_t photographs) const override { return inner_.plans_exposures(photographs); }
  std::size_t together() const override { return inner_.together(); }
  bool computes() const override { return inner_.computes(); }
  void tell(const TakenSome& taken) override { inner_.tell(taken); }
  ProbeCost cost() const override { return inner_.cost(); }
  Result<void> continue_after(const ProbeCost& spent) override { return inner_.continue_after(spent); }
  std::string describe() const override { return inner_.describe(); }
  std::string identity() const override { return inner_.identity(); }

  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return seen(patterns, inner_.measure(patterns));
  }
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override {
    return seen(patterns, inner_.measure_expected(patterns, expected));
  }

 private:
  /// The answer of the inner probe, to be looked at and passed on.
  virtual Result<std::vector<Radiance>> seen(std::span<const Pattern> patterns,
                                             Result<std::vector<Radiance>> photographs) = 0;

  Probe& inner_;
};

}  // namespace symrig
