// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/time_to_go.hpp"

#include <chrono>
#include <string>

namespace symrig::apps {

/// From now on Ctrl-C (or SIGTERM, SIGHUP) asks the running job to stop at its next photograph; a second
/// Ctrl-C or SIGTERM ends the process at once.
void catch_interrupts();
bool interrupted();

/// One line of progress on a terminal's stderr, rewritten in place and never wider than the terminal; silent
/// in a pipe. Also the way by which Ctrl-C reaches the library.
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
  std::string line(const ProgressEvent& event, double seconds) const;

  std::string command_, unit_, stage_;
  bool terminal_;
  bool shown_ = false;
  TimeToGo to_go_;
  Clock::time_point start_, next_;
};

}  // namespace symrig::apps
