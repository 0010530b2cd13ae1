// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"

#include <chrono>
#include <string>

namespace symrig::apps {

/// From now on Ctrl-C (or SIGTERM, SIGHUP) asks the running job to stop at its next photograph; a second
/// Ctrl-C or SIGTERM ends the process at once.
void catch_interrupts();
bool interrupted();

/// One line of progress on a terminal's stderr, rewritten in place; silent in a pipe. Also the way by which
/// Ctrl-C reaches the library.
class Meter {
 public:
  /// unit: what is counted, "photographs".
  Meter(std::string command, std::string unit);
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;
  ~Meter();

  /// Callable as long as the meter lives.
  Progress progress();

 private:
  using Clock = std::chrono::steady_clock;
  bool report(const ProgressEvent& event);
  void enter_stage(const ProgressEvent& event, Clock::time_point now);
  std::string line(const ProgressEvent& event, Clock::time_point now) const;

  std::string command_, unit_, stage_;
  bool terminal_;
  bool shown_ = false;
  std::int64_t stage_first_ = 0;
  Clock::time_point start_, stage_start_, next_;
};

}  // namespace symrig::apps
