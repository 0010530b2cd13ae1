// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

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

/// Why a child's bytes stop.
enum class Silence : std::uint8_t {
  ended,    ///< it has ended, or has closed its output
  deaf,     ///< it has closed its input, or asks for nothing before it has read its input
  timeout,  ///< no byte has moved within the patience
  stopped,  ///< keep_waiting said so
};

/// Bytes to and from a child, both at once: it may answer before it has read all, and read before we have
/// heard all. So two full pipes are no deadlock.
class ChildTalk {
 public:
  /// child must outlive this.
  ChildTalk(const ChildProcess& child, Nanoseconds patience, std::function<bool()> keep_waiting);

  void set_patience(Nanoseconds patience) { patience_ = patience; }

  /// Queues bytes. They must live until flush() has returned.
  void send(std::span<const std::byte> bytes);
  /// Fills all of `into`. none: done.
  std::optional<Silence> receive(std::span<std::byte> into);
  /// Reads up to a line feed, which is left out. Stops at the first byte that differs from `begin`, and after
  /// `longest` bytes. So a line that is wrong is not waited for.
  std::optional<Silence> receive_line(std::string& line, std::string_view begin, std::size_t longest);
  /// Sends all that is queued. Stops if the child answers meanwhile: unread() then has bytes.
  std::optional<Silence> flush();
  /// Bytes that have come and are not yet received. Asks the pipe for more if there are none.
  std::span<const std::byte> unread();

 private:
  std::optional<Silence> move_bytes();
  bool write_some();
  bool read_some();

  const ChildProcess& child_;
  Nanoseconds patience_;
  std::function<bool()> keep_waiting_;
  std::deque<std::span<const std::byte>> queue_;
  std::vector<std::byte> buffer_;
  std::size_t begin_ = 0, end_ = 0;  // what is unread in buffer_
  bool closed_ = false;              // the child's output
  bool deaf_ = false;                // the child has closed its input
};

}  // namespace symrig::rig
