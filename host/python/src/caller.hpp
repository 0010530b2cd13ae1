// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"

#include <functional>
#include <optional>
#include <string>
#include <utility>

#include <pybind11/pybind11.h>

namespace symrig::python {

/// Carries an Error through pybind11, which turns it into the exception of symrig/_errors.py.
struct Failure {
  Error error;
};

/// The value, or its error as a Failure.
template <class T>
T value_of(Result<T> result) {
  if (!result) throw Failure{std::move(result).error()};
  return *std::move(result);
}

inline void check(const Result<void>& result) {
  if (!result) throw Failure{result.error()};
}

/// A Python warning at the line that called symrig. Where the user makes warnings errors, it is raised.
void warn(const std::string& text);

namespace py = pybind11;

/// Lets a long job of the library call Python. The job runs without the interpreter's lock. Each call takes
/// the lock, handles signals (Ctrl-C), and keeps an exception. It must outlive the job.
class Caller {
 public:
  /// callback: called with a symrig.Progress for each step; None: only signals are handled. If it returns
  /// False, the job stops.
  explicit Caller(py::object callback = py::none()) : callback_(std::move(callback)) {}

  /// Whom to tell from now on.
  void tell(py::object callback) { callback_ = std::move(callback); }
  Progress progress();
  /// For waits of the library: false after a signal.
  std::function<bool()> keep_waiting();

  /// Runs Python code. Its exception is kept for finish(), and the result is an Error that ends the job.
  template <class T>
  Result<T> call(const std::function<T()>& python) {
    const py::gil_scoped_acquire lock;
    try {
      return python();
    } catch (py::error_already_set& raised) {
      keep(raised);
    } catch (const Failure& failure) {
      return failure.error;
    }
    return Error{ErrorCode::interrupted, "the Python code of this job raised an exception", ""};
  }

  /// Why a job has failed, in one line: the kept exception of the Python code, or the job's own error.
  std::string reason(const Error& job) const;

  /// Runs the job without the lock. Then raises the kept exception, or the job's error, or returns its value.
  template <class Job>
  auto run(Job&& job) {
    auto result = [&] {
      const py::gil_scoped_release unlocked;
      return std::forward<Job>(job)();
    }();
    if (raised_) raise(result ? Error{} : result.error());
    if (!result) throw Failure{std::move(result).error()};
    return *std::move(result);
  }

 private:
  bool go_on(const ProgressEvent* event);
  void keep(py::error_already_set& raised);
  [[noreturn]] void raise(const Error& job);

  py::object callback_;
  std::optional<py::error_already_set> raised_;
};

}  // namespace symrig::python
