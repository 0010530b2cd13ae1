// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

namespace symrig {

/// How many more units a job takes. What is not known yet lies between two bounds.
struct UnitsToCome {
  std::int64_t least = 0;
  std::int64_t most = -1;  ///< below 0: nobody knows

  bool known() const { return most >= least; }
};
inline constexpr UnitsToCome kNoneToCome{0, 0};

/// Where a long job stands. The library reports it; only apps/ print it.
struct ProgressEvent {
  std::string_view stage;     ///< "level 3", "decoding", ...
  std::int64_t done = 0;      ///< units finished (photographs in a capture)
  std::int64_t expected = 0;  ///< units expected in this stage so far; 0 = not known
  UnitsToCome later = {};     ///< after this stage
};

/// Called from the thread that does the work. Returns false to stop the job: it ends with
/// ErrorCode::interrupted.
using Progress = std::function<bool(const ProgressEvent&)>;

}  // namespace symrig
