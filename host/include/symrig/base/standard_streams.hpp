// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <string_view>

namespace symrig {

/// First thing in a program: descriptors 0 to 2 that are closed lead nowhere from now on. Otherwise the next
/// file that the program opens would become its standard output. Reading and writing them fails, as before.
void reserve_standard_streams();

/// Writes all of it to standard output.  fails: io (closed, a full disk).
Result<void> write_standard_output(std::string_view text);

/// Writes to standard error. What cannot be written is lost: there is nowhere left to tell it.
void write_standard_error(std::string_view text);

}  // namespace symrig
