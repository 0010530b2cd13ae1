// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/stopwatch.hpp"
#include "symrig/base/time_to_go.hpp"

#include <string>

namespace symrig::apps {

/// From now on Ctrl-C (or SIGTERM, SIGHUP) asks the running job to stop at its next photograph. A second
/// Ctrl-C or SIGTERM ends the process at once.
void catch_interrupts();
bool interrupted();

/// Shows one line of progress on standard error and rewrites it in place. The line is never wider than the
/// terminal. In a pipe it shows nothing. It also passes Ctrl-C to the library.
class Meter {
 public:
  /// unit: what is counted, such as "photographs".
  Meter(std::string command, std::string unit);
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;
  ~Meter();

  /// A line that stays, above the progress. In a pipe it is not shown.
  void say(const std::string& text);

  /// The callback for the library. It must not be used after the meter is destroyed.
  Progress progress();

 private:
  bool report(const ProgressEvent& event);
  std::string line(const ProgressEvent& event, double seconds) const;

  std::string command_, unit_, stage_;
  bool terminal_;
  bool shown_ = false;
  TimeToGo to_go_;
  Stopwatch watch_;
  Deadline next_{Nanoseconds{0}};  ///< the line is rewritten from then on
};

}  // namespace symrig::apps
