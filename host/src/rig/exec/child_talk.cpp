// SPDX-License-Identifier: Apache-2.0
#include "rig/exec/child_talk.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>

#include <poll.h>
#include <unistd.h>

namespace symrig::rig {
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
