// SPDX-License-Identifier: Apache-2.0
#include "caller.hpp"

#include "symrig/base/text.hpp"

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

}  // namespace symrig::python
