// SPDX-License-Identifier: Apache-2.0
// The head of a photograph log: what it is, and of which capture (docs/photograph-log.md).
#pragma once

#include "acquisition/log/appended_file.hpp"
#include "symrig/acquisition/photograph_log.hpp"

namespace symrig::acquisition {

/// The bytes that a log of this capture begins with.
std::vector<std::byte> log_head(const LogIdentity& identity);

/// Whether the file begins with the head of this capture.
enum class HeadState : std::uint8_t {
  whole,
  whole_of_version_1,  ///< its records say nothing of budgets, and must not
  torn,                ///< its writer was killed before the head was complete: no photograph is lost
};
/// fails: bad_format (not a log, a newer version, another capture: the first difference is named), io.
Result<HeadState> check_log_head(const AppendedFile& file, const LogIdentity& identity);

/// A head, whichever capture it is of.
struct FoundHead {
  Grid grid;
  int channels = 1;
  std::uint64_t bytes = 0;  ///< photographs begin here
};
/// fails: bad_format (not a log, a newer version, damaged), io.
Result<FoundHead> read_log_head(const AppendedFile& file);

}  // namespace symrig::acquisition
