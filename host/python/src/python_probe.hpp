// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "caller.hpp"
#include "symrig/acquisition/probe.hpp"

#include <string>

#include <pybind11/pybind11.h>

namespace symrig::python {

/// A symrig.Probe of Python as a Probe of the library. measure() takes the interpreter's lock, and gives all
/// patterns of a call as one array [count, rows, cols].
class PythonProbe final : public Probe {
 public:
  /// Reads grid, channels, views and name once.  caller: keeps exceptions of the rig; it must outlive this.
  /// fails (Failure): bad_argument.
  PythonProbe(pybind11::object rig, Caller& caller);

  Grid grid() const override { return grid_; }
  ViewLayout views() const override { return views_; }
  int channels() const override { return channels_; }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;
  std::size_t together() const override { return together_; }
  ProbeCost cost() const override { return cost_; }
  std::string describe() const override { return name_; }

 private:
  std::vector<Radiance> ask(std::span<const Pattern> patterns);

  pybind11::object rig_;
  Caller& caller_;
  Grid grid_;
  ViewLayout views_;
  int channels_ = 1;
  std::size_t together_ = 1;
  std::string name_;
  ProbeCost cost_;
};

}  // namespace symrig::python
