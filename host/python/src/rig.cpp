// SPDX-License-Identifier: Apache-2.0
#include "rig.hpp"

#include "arrays.hpp"
#include "bindings.hpp"
#include "failure.hpp"
#include "python_probe.hpp"
#include "scene.hpp"

#include <utility>

#include <pybind11/stl.h>

namespace symrig::python {
namespace {

py::list measure(RigInUse& rig, const FloatArray& patterns) {
  const std::vector<Pattern> shown = images_of(patterns, "the patterns");
  const Turn turn(rig);
  std::vector<Radiance> seen = rig.caller->run([&] { return rig.opened.probe->measure(shown); });
  py::list photographs;
  for (Radiance& one : seen) photographs.append(to_python(std::move(one)));
  return photographs;
}

Probe& open(RigInUse& rig) {
  if (rig.opened.probe) return *rig.opened.probe;
  throw Failure{{ErrorCode::bad_argument, "the rig is closed", "open it again"}};
}

py::dict cost(RigInUse& rig) {
  const ProbeCost spent = open(rig).cost();
  py::dict all;
  all["photographs"] = spent.photographs;
  all["frames"] = spent.frames;
  all["seconds"] = spent.rig_seconds;
  return all;
}

void close(RigInUse& rig) {
  if (!rig.opened.probe) return;
  const Turn turn(rig);
  const py::gil_scoped_release unlocked;
  rig.opened = OpenedRig{};
}

py::tuple errors(RigInUse& rig, const StoredScene& scene, py::object progress) {
  const Turn turn(rig, std::move(progress));
  return errors_by_rig(scene, *rig.opened.probe, *rig.caller);
}

}  // namespace

Turn::Turn(RigInUse& rig, py::object progress) : rig_(rig) {
  open(rig);
  if (rig_.busy.exchange(true))
    throw Failure{{ErrorCode::bad_argument, "another thread uses the rig", "wait until it is done"}};
  rig_.caller->tell(std::move(progress));
}

Turn::~Turn() {
  rig_.caller->tell(py::none());
  rig_.busy = false;
}

std::unique_ptr<RigInUse> open_rig_by_name(const std::string& rig, const std::string& registration) {
  auto in_use = std::make_unique<RigInUse>();
  Caller& caller = *in_use->caller;
  in_use->opened = caller.run([&] { return open_rig(rig, registration, caller.keep_waiting()); });
  return in_use;
}

std::unique_ptr<RigInUse> rig_of_probe(py::object probe) {
  auto in_use = std::make_unique<RigInUse>();
  in_use->opened.probe = std::make_unique<PythonProbe>(std::move(probe), *in_use->caller);
  in_use->opened.noise = "camera";
  return in_use;
}

void bind_rigs(py::module_& module) {
  py::class_<RigInUse>(module, "Rig")
      .def_property_readonly("grid", [](RigInUse& rig) { return to_python(open(rig).grid()); })
      .def_property_readonly("camera_grid", [](RigInUse& rig) { return to_python(open(rig).camera_grid()); })
      .def_property_readonly("channels", [](RigInUse& rig) { return open(rig).channels(); })
      .def_property_readonly("views",
                             [](RigInUse& rig) {
                               const ViewLayout views = open(rig).views();
                               return py::make_tuple(views.rows, views.cols);
                             })
      .def_property_readonly("name", [](RigInUse& rig) { return open(rig).describe(); })
      .def_property_readonly("cost", cost)
      .def("measure", measure)
      .def("errors", errors)
      .def("close", close);
  module.def("open_rig", open_rig_by_name);
  module.def("rig_of_probe", rig_of_probe);
}

}  // namespace symrig::python
