// SPDX-License-Identifier: Apache-2.0
#include "python_probe.hpp"

#include "arrays.hpp"
#include "failure.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::python {
namespace {

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

}  // namespace

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

}  // namespace symrig::python
