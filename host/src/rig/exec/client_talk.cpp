// SPDX-License-Identifier: Apache-2.0
#include "symrig/rig/internal/client_talk.hpp"

#include <algorithm>
#include <array>
#include <cerrno>

#include <poll.h>
#include <sys/socket.h>

namespace symrig::rig {
namespace {

constexpr Nanoseconds kGlanceAtClient{50'000'000};  // how often keep_going is asked
constexpr int kGlanceAtPlace = 100;                 // ms; the same without a client
constexpr Nanoseconds kFarewell{500'000'000};       // for a client that still sends
constexpr Nanoseconds kLineTime{10'000'000'000};    // from the first byte of a line to its end

int poll_milliseconds(Nanoseconds time) {
  return static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(time).count());
}

bool try_again() {
  return errno == EAGAIN || errno == EINTR;
}

}  // namespace

/// The refused client keeps its socket until the next one is refused. If it were closed at once, with a
/// greeting unread, the system would throw the line away.
void ClientTalk::turn_others_away() {
  constexpr std::string_view kBusy = "busy: another client uses this rig\n";
  Fd other = place_.accept();
  if (!other) return;
  ::send(other.get(), kBusy.data(), kBusy.size(), MSG_NOSIGNAL);
  ::shutdown(other.get(), SHUT_WR);
  turned_away_ = std::move(other);
}

/// Until the client's socket is ready.
bool ClientTalk::wait(short events) {
  const std::optional<Deadline> byte = patience_ ? std::optional(Deadline(*patience_)) : std::nullopt;
  while (keep_going_()) {
    Nanoseconds left = kGlanceAtClient;
    for (const auto& deadline : {byte, greeting_, line_})
      if (deadline) left = std::min(left, deadline->left());
    if (left.count() == 0) return false;
    std::array<pollfd, 2> both{{{client_.get(), events, 0}, {place_.fd(), POLLIN, 0}}};
    const nfds_t watched = greeting_ ? 1 : 2;
    if (::poll(both.data(), watched, poll_milliseconds(left)) <= 0) continue;
    // First the client: it may have gone, and then the place is free for who waits.
    if (both[0].revents != 0) return true;
    turn_others_away();
  }
  return false;
}

bool ClientTalk::receive(std::span<std::byte> into) {
  while (!into.empty()) {
    const ssize_t got = ::recv(client_.get(), into.data(), into.size(), 0);
    if (got == 0 || (got < 0 && !try_again())) return false;
    if (got < 0 && !wait(POLLIN)) return false;
    if (got > 0) into = into.subspan(static_cast<std::size_t>(got));
  }
  return true;
}

bool ClientTalk::receive_line(std::string& line, std::size_t longest) {
  line_.reset();
  std::byte one{};
  bool heard = true;
  for (line.clear(); line.size() < longest && (heard = receive({&one, 1}));) {
    if (static_cast<char>(one) == '\n') break;
    line += static_cast<char>(one);
    if (!line_) line_.emplace(kLineTime);
  }
  line_.reset();
  return heard;
}

bool ClientTalk::send(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::send(client_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && !try_again()) return false;
    if (sent < 0 && !wait(POLLOUT)) return false;
    if (sent > 0) bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
  return true;
}

/// Bytes that are unread when a socket closes make the system throw the line away. So they are read first,
/// for a short time.
void ClientTalk::dismiss(std::string_view line) {
  patience_ = kFarewell;
  greeting_.reset();
  if (!send(line)) return;
  ::shutdown(client_.get(), SHUT_WR);
  std::array<std::byte, 4096> unread{};
  for (const Deadline deadline(kFarewell); !deadline.passed();) {
    const ssize_t got = ::recv(client_.get(), unread.data(), unread.size(), 0);
    if (got == 0 || (got < 0 && !try_again())) return;
    if (got < 0 && !wait(POLLIN)) return;
  }
}

void serve_clients(const board::ListeningPlace& place, const std::function<bool()>& keep_going,
                   const std::function<void(ClientTalk& talk)>& serve) {
  Fd turned_away;
  while (keep_going()) {
    pollfd one{place.fd(), POLLIN, 0};
    if (::poll(&one, 1, kGlanceAtPlace) <= 0) continue;
    Fd client = place.accept();
    if (!client) continue;
    ClientTalk talk(std::move(client), place, turned_away, keep_going);
    serve(talk);
  }
}

}  // namespace symrig::rig
