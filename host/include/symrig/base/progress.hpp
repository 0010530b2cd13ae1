// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

namespace symrig {

/// Where a long job stands. The library reports it; only apps/ print it.
struct ProgressEvent {
  std::string_view stage;     ///< "level 3", "decoding", ...
  std::int64_t done = 0;      ///< units finished (photographs in a capture)
  std::int64_t expected = 0;  ///< units expected in this stage so far; 0 = not known
};

/// Called from the thread that does the work. Returns false to stop the job: it ends with
/// ErrorCode::interrupted.
using Progress = std::function<bool(const ProgressEvent&)>;

}  // namespace symrig
