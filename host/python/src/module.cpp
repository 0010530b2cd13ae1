// SPDX-License-Identifier: Apache-2.0
#include "bindings.hpp"

PYBIND11_MODULE(_symrig, module) {
  using namespace symrig::python;
  module.doc() = "The C++ part of symrig. Import symrig instead.";
  module.attr("version") = SYMRIG_VERSION;
  bind_errors(module);
  bind_pictures(module);
  bind_scene(module);
  bind_rigs(module);
  bind_capture(module);
  bind_photometry(module);
  bind_calibration(module);
  bind_boards(module);
}
