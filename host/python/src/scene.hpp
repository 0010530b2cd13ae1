// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "caller.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/tensor/file.hpp"

#include <pybind11/pybind11.h>

namespace symrig::python {

/// Errors and their half widths, both as dicts, against new photographs of a rig.
/// fails (Failure): as judge_by_rig.
pybind11::tuple errors_by_rig(const StoredScene& scene, Probe& rig, Caller& caller);

}  // namespace symrig::python
