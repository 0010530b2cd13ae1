// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "caller.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/tensor/file.hpp"

#include <atomic>
#include <memory>
#include <string>

#include <pybind11/pybind11.h>

namespace symrig::python {

/// An open rig, and what passes Ctrl-C and exceptions on while it works.
struct RigInUse {
  std::unique_ptr<Caller> caller = std::make_unique<Caller>();
  OpenedRig opened;
  std::atomic<bool> busy = false;
};

/// A rig works for one thread at a time.
class Turn {
 public:
  /// fails (Failure): bad_argument (another thread uses the rig, or it is closed).
  explicit Turn(RigInUse& rig, pybind11::object progress = pybind11::none());
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;
  ~Turn();

 private:
  RigInUse& rig_;
};

/// Opens the rig RIG by its name; registration: a file, or empty.  fails (Failure): as open_rig.
/// most_seconds: RigOptions.
std::unique_ptr<RigInUse> open_rig_by_name(const std::string& rig, const std::string& registration,
                                           double most_seconds);
/// A symrig.Probe of Python as a rig.  fails (Failure): as PythonProbe.
std::unique_ptr<RigInUse> rig_of_probe(pybind11::object probe);

/// Errors and their half widths, both as dicts, against new photographs of a rig.
/// fails (Failure): as judge_by_rig.
pybind11::tuple errors_by_rig(const StoredScene& scene, Probe& rig, Caller& caller);

}  // namespace symrig::python
