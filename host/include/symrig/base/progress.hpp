// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <string_view>

namespace symrig {

/// Bounds on the number of units after the current stage.
struct UnitsToCome {
  std::int64_t least = 0;
  std::int64_t most = -1;  ///< below 0: not known

  bool known() const { return most >= least; }
};
inline constexpr UnitsToCome kNoneToCome{0, 0};

/// Computing work of one stage, in steps (Work::kStep).
struct StepCount {
  std::int64_t done = 0;
  std::int64_t expected = 0;  ///< by the end of the stage; 0 = not known
};

/// The state of a long job. The library reports it; only apps/ print it.
struct ProgressEvent {
  std::string_view stage;     ///< "level 3", "decoding", ...
  std::int64_t done = 0;      ///< units finished (photographs in a capture)
  std::int64_t expected = 0;  ///< units expected in this stage so far; 0 = not known
  UnitsToCome later = {};     ///< after this stage
  StepCount steps = {};       ///< of a capture: what the computer has done in this stage
  bool computing = false;     ///< the stage has no units of its own: its steps move, `done` stands still
};

/// Called by the thread that does the work. Return false to stop the job; it then ends with
/// ErrorCode::interrupted.
using Progress = std::function<bool(const ProgressEvent&)>;

}  // namespace symrig
