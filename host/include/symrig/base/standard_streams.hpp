// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace symrig {

/// A program calls this first. It opens /dev/null for each closed descriptor from 0 to 2, so that reading or
/// writing it still fails. Otherwise the next file that the program opens would become its standard output.
void reserve_standard_streams();

/// Reads standard input to its end.
/// fails: io (closed, a folder); limit (more than max_bytes).
Result<std::string> read_standard_input(std::uint64_t max_bytes);

/// Writes the whole text to standard output.
/// fails: io (closed, a full disk).
Result<void> write_standard_output(std::string_view text);

/// Writes to standard error. Ignores errors, because there is nowhere left to report them.
void write_standard_error(std::string_view text);

}  // namespace symrig
