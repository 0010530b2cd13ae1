// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace symrig {

/// How a file was made. Each part may be empty; it is then not reported.
struct Made {
  std::string date = {};          ///< UTC, as in 2026-01-31T23:59:58Z [ISO 8601]
  std::string version = {};       ///< of symrig
  std::string command_line = {};  ///< as typed into a shell
};

/// The time now, as Made::date has it; empty if the system does not know it.
std::string utc_now();

}  // namespace symrig
