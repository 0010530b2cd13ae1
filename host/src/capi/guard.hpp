// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/symrig.h"

#include <exception>
#include <new>
#include <string_view>

namespace symrig::capi {

/// Fills *error if it is not null, and returns the code.
int report(const Error& failure, symrig_error* error);

/// Gives out a text that the caller must free.
/// fails: limit (no memory).
int give_text(std::string_view text, char** out, symrig_error* error);

/// Runs the body of a function of the C interface. No exception leaves it.
template <class Call>
int guarded(symrig_error* error, Call call) {
  try {
    return call();
  } catch (const std::bad_alloc&) {
    return report({ErrorCode::limit, "out of memory", "use a smaller scene or program"}, error);
  } catch (const std::exception& failure) {
    return report({ErrorCode::fault, std::string("internal fault: ") + failure.what(), "please report it"},
                  error);
  } catch (...) {
    return report({ErrorCode::fault, "internal fault", "please report it"}, error);
  }
}

/// The error for a null pointer that must not be null: bad_argument.
inline int missing(std::string_view what, symrig_error* error) {
  return report({ErrorCode::bad_argument, std::string(what) + " is null", "give a pointer"}, error);
}

}  // namespace symrig::capi
