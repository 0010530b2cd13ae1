// SPDX-License-Identifier: Apache-2.0

#include "caller.hpp"

#include "bindings.hpp"
#include "symrig/base/text.hpp"

#include <exception>
#include <string>

namespace symrig::python {

Progress Caller::progress() {
  return [this](const ProgressEvent& event) { return go_on(&event); };
}

std::function<bool()> Caller::keep_waiting() {
  return [this] { return go_on(nullptr); };
}

bool Caller::go_on(const ProgressEvent* event) {
  const py::gil_scoped_acquire lock;
  if (raised_) return false;
  try {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (event == nullptr || callback_.is_none()) return true;
    const py::object told = py::module_::import("symrig._capture")
                                .attr("Progress")(std::string(event->stage), event->done, event->expected,
                                                  event->steps.done, event->steps.expected);
    return !callback_(told).is(py::bool_(false));
  } catch (py::error_already_set& raised) {
    keep(raised);
    return false;
  }
}

void Caller::keep(py::error_already_set& raised) {
  if (!raised_) raised_.emplace(std::move(raised));
}

std::string Caller::reason(const Error& job) const {
  const py::gil_scoped_acquire lock;
  if (!raised_) return job.line();
  const std::string what = py::str(raised_->type().attr("__name__")).cast<std::string>() + ": " +
                           py::str(raised_->value()).cast<std::string>();
  return printable_line(job.hint.empty() ? what : what + "; " + job.hint);
}

/// The exception of the Python code says in a note what the job has kept.
void Caller::raise(const Error& job) {
  py::error_already_set raised = *std::exchange(raised_, std::nullopt);
  if (!job.hint.empty()) raised.value().attr("add_note")("symrig: " + job.hint);
  throw py::error_already_set(raised);
}

namespace {

namespace py = pybind11;

/// A message may quote a damaged file.
py::str text_of(const std::string& message) {
  return py::reinterpret_steal<py::str>(
      PyUnicode_DecodeUTF8(message.data(), static_cast<Py_ssize_t>(message.size()), "replace"));
}

void raise(const Error& error) {
  const py::object exception =
      py::module_::import("symrig._errors")
          .attr("error_of")(static_cast<int>(error.code), std::string(name(error.code)), text_of(error.what),
                            text_of(error.hint));
  PyErr_SetObject(py::type::handle_of(exception).ptr(), exception.ptr());
}

}  // namespace

void bind_errors(py::module_& /*module*/) {
  // NOLINTNEXTLINE(performance-unnecessary-value-param): the type of the function is pybind11's
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const Failure& failure) {
      raise(failure.error);
    }
  });
}

void warn(const std::string& text) {
  constexpr int kCaller = 2;  // 1: the function of this package
  if (PyErr_WarnEx(PyExc_UserWarning, text.c_str(), kCaller) != 0) throw py::error_already_set();
}

}  // namespace symrig::python
