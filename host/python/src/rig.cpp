// SPDX-License-Identifier: Apache-2.0

#include "rig.hpp"

#include "arrays.hpp"
#include "bindings.hpp"
#include "caller.hpp"
#include "symrig/acquisition/probe.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

namespace symrig::python {

namespace {

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

constexpr int kMostChannels = 64;

int whole_number(const py::object& rig, const char* attribute, int most) {
  const py::object value = rig.attr(attribute);
  if (py::isinstance<py::int_>(value)) {
    const auto number = value.cast<long long>();
    if (number >= 1 && number <= most) return static_cast<int>(number);
  }
  throw Failure{{ErrorCode::bad_argument,
                 fmt::format("the rig's {} is {}", attribute, py::repr(value).cast<std::string>()),
                 fmt::format("give a whole number from 1 to {}", most)}};
}

double number_of(const py::object& seconds) {
  const double number = PyFloat_AsDouble(seconds.ptr());
  if (PyErr_Occurred() == nullptr) return number;
  PyErr_Clear();
  throw Failure{{ErrorCode::bad_value,
                 fmt::format("the rig's seconds is {}", py::repr(seconds).cast<std::string>()),
                 "keep a number there, or None"}};
}

ViewLayout layout_of(const py::object& rig, Grid grid) {
  const Grid given = grid_of(rig.attr("views"), "the rig's views");
  const ViewLayout views{given.rows, given.cols};
  if (views.fits(grid)) return views;
  throw Failure{{ErrorCode::bad_argument,
                 fmt::format("the rig's views {} do not fit its grid {}", to_string(views), to_string(grid)),
                 "give the rows and columns of views that tile the grid"}};
}

/// [count, rows, cols], in memory of Python.
py::array_t<float> stacked(std::span<const Pattern> patterns, Grid grid) {
  py::array_t<float> all(std::vector<py::ssize_t>{std::ssize(patterns), grid.rows, grid.cols});
  float* to = all.mutable_data();
  for (const Pattern& pattern : patterns)
    to = std::copy(pattern.values().begin(), pattern.values().end(), to);
  return all;
}

Failure wrong_count(std::size_t answers, std::size_t patterns) {
  return {{ErrorCode::size_mismatch,
           fmt::format("measure() answered {} photographs for {} patterns", answers, patterns),
           "answer one photograph for each pattern"}};
}

PythonProbe::PythonProbe(py::object rig, Caller& caller)
    : rig_(std::move(rig)),
      caller_(caller),
      grid_(grid_of(rig_.attr("grid"), "the rig's grid")),
      views_(layout_of(rig_, grid_)),
      channels_(whole_number(rig_, "channels", kMostChannels)),
      together_(whole_number(rig_, "together", 1 << 20)),
      name_(py::str(rig_.attr("name"))) {}

Result<std::vector<Radiance>> PythonProbe::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(check_patterns(*this, patterns));
  if (patterns.empty()) return std::vector<Radiance>();
  auto photographs = caller_.call<std::vector<Radiance>>([&] { return ask(patterns); });
  if (!photographs) return photographs;
  cost_.photographs += std::ssize(patterns);
  cost_.frames += std::ssize(patterns);
  return photographs;
}

std::vector<Radiance> PythonProbe::ask(std::span<const Pattern> patterns) {
  const py::object answers = rig_.attr("measure")(stacked(patterns, grid_));
  const bool array = py::isinstance<py::array>(answers);
  const bool text = py::isinstance<py::str>(answers) || py::isinstance<py::bytes>(answers);
  if (array ? answers.attr("ndim").cast<int>() == 0 : text || !py::isinstance<py::sequence>(answers))
    throw Failure{{ErrorCode::bad_value, "measure() answered " + std::string(py::str(py::type::of(answers))),
                   "answer an array [count, rows, cols], or a list with one photograph for each pattern"}};
  if (const std::size_t count = py::len(answers); count != patterns.size())
    throw wrong_count(count, patterns.size());
  std::vector<Radiance> photographs;
  for (std::size_t k = 0; k < patterns.size(); ++k)
    photographs.push_back(
        radiance_of(answers[py::int_(k)], grid_, channels_, fmt::format("photograph {}", k)));
  const py::object seconds = rig_.attr("seconds");
  if (!seconds.is_none()) cost_.rig_seconds = number_of(seconds);
  return photographs;
}

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

std::unique_ptr<RigInUse> open_rig_by_name(const std::string& rig, const std::string& registration,
                                           double most_seconds) {
  auto in_use = std::make_unique<RigInUse>();
  Caller& caller = *in_use->caller;
  in_use->opened =
      caller.run([&] { return open_rig(rig, registration, caller.keep_waiting(), most_seconds); });
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
  module.def("open_rig", [](const std::string& rig, const std::string& registration) {
    return open_rig_by_name(rig, registration, std::numeric_limits<double>::infinity());
  });
  module.def("rig_of_probe", rig_of_probe);
}

}  // namespace symrig::python
