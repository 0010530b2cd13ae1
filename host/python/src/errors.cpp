// SPDX-License-Identifier: Apache-2.0
#include "bindings.hpp"
#include "failure.hpp"

#include <exception>
#include <string>

namespace symrig::python {
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
