// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <functional>
#include <optional>
#include <string>

#include <sys/types.h>

namespace symrig::rig {

/// How a process ended.
struct ProcessEnd {
  bool by_signal = false;
  int number = 0;  ///< exit status or signal
};

/// "ended with status 3", "was ended by signal 9 (Killed)".
std::string to_string(const ProcessEnd& end);

/// A shell command in a process group of its own, with pipes to its standard input and from its standard
/// output.
class ChildProcess {
 public:
  /// Our ends of the pipes do not block. No other child inherits them.
  /// fails: io.
  static Result<ChildProcess> start(const std::string& command);
  ChildProcess(ChildProcess&& other) noexcept;
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess() { end({}, {}); }

  int input() const { return input_.get(); }    ///< write here
  int output() const { return output_.get(); }  ///< read here

  /// How the command ended; none: it still runs.
  std::optional<ProcessEnd> ended() const;
  /// Waits for it. keep_waiting: false: stop waiting; may be empty.
  std::optional<ProcessEnd> wait(Nanoseconds patience, const std::function<bool()>& keep_waiting) const;
  /// Closes the pipes and waits. A command that runs on after `grace` gets SIGTERM, and one second later
  /// SIGKILL, with all its process group. Nothing of the group is left afterwards.
  void end(Nanoseconds grace, const std::function<bool()>& keep_waiting);

 private:
  ChildProcess(pid_t process, Fd input, Fd output)
      : process_(process), input_(std::move(input)), output_(std::move(output)) {}

  pid_t process_ = -1;  // -1: ended and reaped. It leads its process group.
  Fd input_, output_;
};

}  // namespace symrig::rig
