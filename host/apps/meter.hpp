// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/time.hpp"

#include <cstdint>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// From now on Ctrl-C (or SIGTERM, SIGHUP) asks the running job to stop at its next photograph. A second
/// Ctrl-C or SIGTERM ends the process at once.
void catch_interrupts();
bool interrupted();

/// Adds --progress to a command that has a Meter.
void add_progress(CLI::App& command);

/// Shows one line of progress on standard error and rewrites it in place. The line is never wider than the
/// terminal. In a pipe it shows nothing. With --progress json each event is a line of JSON instead, also in a
/// pipe. It also passes Ctrl-C to the library.
class Meter {
 public:
  /// unit: what is counted, such as "photographs".
  Meter(std::string command, std::string unit);
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;
  ~Meter();

  /// A line that stays, above the progress. In a pipe it is not shown, nor beside lines of JSON.
  void say(const std::string& text);

  /// The callback for the library. It must not be used after the meter is destroyed.
  Progress progress();

 private:
  bool report(const ProgressEvent& event);
  bool is_news(const ProgressEvent& event);
  std::string json_line(const ProgressEvent& event, double seconds) const;
  std::string line(const ProgressEvent& event, double seconds) const;

  std::string command_, unit_, stage_;
  bool json_, terminal_;
  bool shown_ = false;
  std::int64_t done_ = -1, steps_ = -1;  ///< of the line before
  TimeToGo to_go_;
  Stopwatch watch_;
  Deadline next_{Nanoseconds{0}};  ///< the line is rewritten from then on
};

}  // namespace symrig::apps
