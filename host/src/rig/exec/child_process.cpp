// SPDX-License-Identifier: Apache-2.0
#include "rig/exec/child_process.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace symrig::rig {
namespace {

constexpr int kFirstFree = STDERR_FILENO + 1;
constexpr Nanoseconds kLastChance{1'000'000'000};  // between SIGTERM and SIGKILL
constexpr Nanoseconds kShortestNap{500'000}, kLongestNap{20'000'000};

Error cannot_start(const std::string& command, int error) {
  return {ErrorCode::io,
          fmt::format("cannot start '{}' ({})", command, std::generic_category().message(error)),
          "free memory or end other processes"};
}

struct Pipe {
  Fd read, write;
};

/// A pipe whose ends are none of the standard streams, so that dup2() to these overwrites none of them.
std::optional<Pipe> open_pipe() {
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  const auto raised = [](int end) {
    const Fd low(end);
    return Fd(::fcntl(end, F_DUPFD_CLOEXEC, kFirstFree));
  };
  Pipe pipe{raised(ends[0]), raised(ends[1])};
  if (!pipe.read || !pipe.write) return std::nullopt;
  return pipe;
}

bool do_not_block(const Fd& fd) {
  return ::fcntl(fd.get(), F_SETFL, ::fcntl(fd.get(), F_GETFL) | O_NONBLOCK) == 0;
}

/// A new process group, no signal blocked, and a broken pipe ends the command as usual.
void set_attributes(posix_spawnattr_t& attributes) {
  sigset_t none, pipe;
  sigemptyset(&none);
  sigemptyset(&pipe);
  sigaddset(&pipe, SIGPIPE);
  ::posix_spawnattr_setsigmask(&attributes, &none);
  ::posix_spawnattr_setsigdefault(&attributes, &pipe);
  ::posix_spawnattr_setpgroup(&attributes, 0);
  ::posix_spawnattr_setflags(&attributes, static_cast<short>(POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGMASK |
                                                             POSIX_SPAWN_SETSIGDEF));
}

/// 0, or the system's error.
int spawn(const std::string& command, const Fd& in, const Fd& out, pid_t& process) {
  posix_spawn_file_actions_t actions;
  posix_spawnattr_t attributes;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawnattr_init(&attributes);
  ::posix_spawn_file_actions_adddup2(&actions, in.get(), STDIN_FILENO);
  ::posix_spawn_file_actions_adddup2(&actions, out.get(), STDOUT_FILENO);
  set_attributes(attributes);
  std::array<std::string, 3> words{"sh", "-c", command};
  std::array<char*, 4> arguments{words[0].data(), words[1].data(), words[2].data(), nullptr};
  const int error = ::posix_spawn(&process, "/bin/sh", &actions, &attributes, arguments.data(), environ);
  ::posix_spawnattr_destroy(&attributes);
  ::posix_spawn_file_actions_destroy(&actions);
  return error;
}

}  // namespace

std::string to_string(const ProcessEnd& end) {
  if (end.by_signal) return fmt::format("was ended by signal {} ({})", end.number, strsignal(end.number));
  constexpr int kBySignal = 128;  // a shell's status for a command that a signal has ended
  const int signal = end.number - kBySignal;
  if (signal > 0 && signal < NSIG)
    return fmt::format("ended with status {} (signal {}, {})", end.number, signal, strsignal(signal));
  return fmt::format("ended with status {}", end.number);
}

Result<ChildProcess> ChildProcess::start(const std::string& command) {
  auto in = open_pipe(), out = open_pipe();
  if (!in || !out || !do_not_block(in->write) || !do_not_block(out->read))
    return cannot_start(command, errno);
  pid_t process = -1;
  if (const int error = spawn(command, in->read, out->write, process); error != 0)
    return cannot_start(command, error);
  return ChildProcess(process, std::move(in->write), std::move(out->read));
}

ChildProcess::ChildProcess(ChildProcess&& other) noexcept
    : process_(std::exchange(other.process_, -1)),
      input_(std::move(other.input_)),
      output_(std::move(other.output_)) {}

/// Does not reap the process, so that its number keeps naming its group.
std::optional<ProcessEnd> ChildProcess::ended() const {
  siginfo_t info{};
  const int failed = ::waitid(P_PID, static_cast<id_t>(process_), &info, WEXITED | WNOHANG | WNOWAIT);
  if (failed != 0) return errno == EINTR ? std::nullopt : std::optional(ProcessEnd{});
  if (info.si_pid == 0) return std::nullopt;
  return ProcessEnd{info.si_code != CLD_EXITED, info.si_status};
}

std::optional<ProcessEnd> ChildProcess::wait(Nanoseconds patience,
                                             const std::function<bool()>& keep_waiting) const {
  const Deadline deadline(patience);
  for (Nanoseconds nap = kShortestNap;; nap = std::min(2 * nap, kLongestNap)) {
    const auto end = ended();
    if (end || deadline.passed() || (keep_waiting && !keep_waiting())) return end;
    std::this_thread::sleep_for(nap);
  }
}

void ChildProcess::end(Nanoseconds grace, const std::function<bool()>& keep_waiting) {
  input_.close();
  output_.close();
  if (process_ < 0) return;
  if (!wait(grace, keep_waiting)) {
    ::kill(-process_, SIGTERM);
    wait(kLastChance, {});
  }
  ::kill(-process_, SIGKILL);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) continue;
  process_ = -1;
}

}  // namespace symrig::rig
