// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string>
#include <utility>

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

}  // namespace symrig::python
