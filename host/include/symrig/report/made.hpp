// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace symrig {

/// What made a file. Each part may be empty: then nothing is told of it.
struct Made {
  std::string date = {};          ///< UTC, as in 2026-01-31T23:59:58Z [ISO 8601]
  std::string version = {};       ///< of symrig
  std::string command_line = {};  ///< as it can be typed into a shell
};

}  // namespace symrig
