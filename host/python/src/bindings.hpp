// SPDX-License-Identifier: Apache-2.0
// The parts of the module _symrig. symrig/*.py builds the public module from them.
#pragma once

#include <pybind11/pybind11.h>

namespace symrig::python {

void bind_errors(pybind11::module_& module);
void bind_pictures(pybind11::module_& module);
void bind_scene(pybind11::module_& module);
void bind_rigs(pybind11::module_& module);
void bind_capture(pybind11::module_& module);
void bind_photometry(pybind11::module_& module);
void bind_calibration(pybind11::module_& module);
void bind_boards(pybind11::module_& module);

}  // namespace symrig::python
