// SPDX-License-Identifier: Apache-2.0

#include "rig/exec/child_talk.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <system_error>
#include <thread>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
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

namespace {

constexpr std::size_t kPiece = 65'536;
constexpr Nanoseconds kGlance{100'000'000};  // how often keep_waiting is asked

/// While it lives, a broken pipe sends this thread no SIGPIPE. A SIGPIPE from before stays.
class NoSigpipe {
 public:
  NoSigpipe() {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    sigset_t pending;
    sigpending(&pending);
    pending_ = sigismember(&pending, SIGPIPE) == 1;
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  NoSigpipe(const NoSigpipe&) = delete;
  NoSigpipe& operator=(const NoSigpipe&) = delete;
  ~NoSigpipe() {
    const timespec now{0, 0};
    if (!pending_)
      while (sigtimedwait(&pipe_, nullptr, &now) < 0 && errno == EINTR) continue;
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }

 private:
  sigset_t pipe_{}, before_{};
  bool pending_ = false;
};

int milliseconds(Nanoseconds time) {
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(time).count());
}

}  // namespace

ChildTalk::ChildTalk(const ChildProcess& child, Nanoseconds patience, std::function<bool()> keep_waiting)
    : child_(child), patience_(patience), keep_waiting_(std::move(keep_waiting)), buffer_(kPiece) {}

void ChildTalk::send(std::span<const std::byte> bytes) {
  if (!bytes.empty()) queue_.push_back(bytes);
}

/// Whether bytes have moved. A pipe whose other end is closed loses what is queued.
bool ChildTalk::write_some() {
  const NoSigpipe guard;
  const ssize_t sent = ::write(child_.input(), queue_.front().data(), queue_.front().size());
  if (sent < 0) {
    deaf_ = errno != EAGAIN && errno != EINTR;
    if (deaf_) queue_.clear();
    return false;
  }
  queue_.front() = queue_.front().subspan(static_cast<std::size_t>(sent));
  if (queue_.front().empty()) queue_.pop_front();
  return true;
}

/// Whether bytes have moved. Nothing may be unread.
bool ChildTalk::read_some() {
  const ssize_t got = ::read(child_.output(), buffer_.data(), buffer_.size());
  begin_ = 0;
  end_ = got > 0 ? static_cast<std::size_t>(got) : 0;
  closed_ = closed_ || got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR);
  return got > 0;
}

/// Waits until a byte has moved in either direction.
std::optional<Silence> ChildTalk::move_bytes() {
  const Deadline deadline(patience_);
  while (!closed_) {
    if (keep_waiting_ && !keep_waiting_()) return Silence::stopped;
    if (deadline.passed()) return Silence::timeout;
    std::array<pollfd, 2> both{
        {{child_.output(), POLLIN, 0}, {queue_.empty() ? -1 : child_.input(), POLLOUT, 0}}};
    const bool over = child_.ended().has_value();  // before the pipes: what it has written is in them by now
    const int ready =
        ::poll(both.data(), both.size(), over ? 0 : milliseconds(std::min(deadline.left(), kGlance)));
    if (ready == 0 && over) return Silence::ended;  // another process may hold the pipe open
    const bool wrote = ready > 0 && both[1].revents != 0 && write_some();
    const bool read = ready > 0 && both[0].revents != 0 && read_some();
    if (wrote || read) return std::nullopt;
  }
  return Silence::ended;
}

std::span<const std::byte> ChildTalk::unread() {
  if (begin_ == end_ && !closed_) read_some();
  return std::span(buffer_).subspan(begin_, end_ - begin_);
}

std::optional<Silence> ChildTalk::receive(std::span<std::byte> into) {
  while (!into.empty()) {
    const std::size_t count = std::min(into.size(), end_ - begin_);
    std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(begin_), count, into.begin());
    begin_ += count;
    into = into.subspan(count);
    if (into.empty()) break;
    if (const auto silence = move_bytes()) return silence;
  }
  return std::nullopt;
}

std::optional<Silence> ChildTalk::receive_line(std::string& line, std::string_view begin,
                                               std::size_t longest) {
  for (line.clear(); line.size() < longest;) {
    std::byte one{};
    if (const auto silence = receive({&one, 1})) return silence;
    if (static_cast<char>(one) == '\n') return std::nullopt;
    line += static_cast<char>(one);
    if (line.size() <= begin.size() && line.back() != begin[line.size() - 1]) return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Silence> ChildTalk::flush() {
  while (!queue_.empty()) {
    if (begin_ != end_) return std::nullopt;
    if (const auto silence = move_bytes()) return silence;
  }
  if (deaf_) return Silence::deaf;
  return std::nullopt;
}

}  // namespace symrig::rig
