// SPDX-License-Identifier: Apache-2.0
#include "socket_transport.hpp"

#include "clock.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace symrig::board_linux {
namespace {

constexpr int kQueue = 8;
constexpr std::size_t kGuests = 8;
constexpr hal::Tick kGuestPatience = 1'000'000'000;  // drops a second host that sends nothing for this long
constexpr mode_t kUserAndGroup = 0660;

bool again(int error) {
  return error == EAGAIN || error == EWOULDBLOCK || error == EINTR;
}

Error no_socket(const std::string& name, int error) {
  const bool taken = error == EADDRINUSE;
  return {ErrorCode::io, fmt::format("cannot serve {} ({})", name, std::strerror(error)),
          taken ? "another daemon serves it: end that one, or choose another address in board.toml"
                : "check that its folder exists and that you may write to it"};
}

const sockaddr* as_sockaddr(const sockaddr_un& address) {
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how sockets take addresses
  return reinterpret_cast<const sockaddr*>(&address);
}

Fd new_socket(int family, int protocol = 0) {
  return Fd(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, protocol));
}

bool answers(const sockaddr_un& address) {
  const Fd probe = new_socket(AF_UNIX);
  return ::connect(probe.get(), as_sockaddr(address), sizeof address) == 0 || errno == EAGAIN;
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

}  // namespace

Result<std::unique_ptr<SocketTransport>> SocketTransport::listen_unix(const std::string& path) {
  const std::string name = "unix:" + path;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    return Error{ErrorCode::bad_argument, name + ": the path is too long for a socket", "use a shorter one"};
  std::memcpy(address.sun_path, path.data(), path.size());
  if (answers(address)) return no_socket(name, EADDRINUSE);
  // Removes the socket of an earlier daemon. Any other file stays, in case the path is a mistake.
  struct stat status {};
  if (::lstat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode)) ::unlink(path.c_str());
  Fd listener = new_socket(AF_UNIX);
  if (!listener || ::bind(listener.get(), as_sockaddr(address), sizeof address) != 0)
    return no_socket(name, errno);
  ::chmod(path.c_str(), kUserAndGroup);
  if (::listen(listener.get(), kQueue) != 0) return no_socket(name, errno);
  return std::unique_ptr<SocketTransport>(new SocketTransport(std::move(listener), name, path));
}

Result<std::unique_ptr<SocketTransport>> SocketTransport::listen_tcp(const std::string& host,
                                                                     std::uint16_t port) {
  const std::string name = fmt::format("tcp:{}:{}", host, port);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_PASSIVE | AI_NUMERICHOST;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found); code != 0)
    return Error{ErrorCode::bad_argument, fmt::format("{}: {}", name, ::gai_strerror(code)),
                 "give the numeric address of one of this computer's interfaces"};
  const std::unique_ptr<addrinfo, FreeAddresses> addresses(found);
  Fd listener = new_socket(found->ai_family, found->ai_protocol);
  const int on = 1;
  ::setsockopt(listener.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (!listener || ::bind(listener.get(), found->ai_addr, found->ai_addrlen) != 0 ||
      ::listen(listener.get(), kQueue) != 0)
    return no_socket(name, errno);
  return std::unique_ptr<SocketTransport>(new SocketTransport(std::move(listener), name, ""));
}

SocketTransport::~SocketTransport() {
  if (!path_.empty()) ::unlink(path_.c_str());
}

void SocketTransport::watch(std::vector<pollfd>& fds) const {
  fds.push_back({listener_.get(), POLLIN, 0});
  const auto wanted = static_cast<short>((in_.size() < kRoom ? POLLIN : 0) | (out_.empty() ? 0 : POLLOUT));
  if (peer_) fds.push_back({peer_.get(), wanted, 0});
  for (const Guest& guest : guests_) fds.push_back({guest.fd.get(), POLLIN, 0});
}

void SocketTransport::serve() {
  if (peer_) fill();
  if (peer_) flush();
  // The next host waits for one round, else nobody would notice that the last one disconnected.
  if (!left_) accept_hosts();
  left_ = false;
  answer_guests();
}

void SocketTransport::accept_hosts() {
  while (true) {
    Fd fd(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!fd) return;
    const int on = 1;
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);  // has no effect on a Unix socket
    if (!peer_) {
      peer_ = std::move(fd);
      fill();
    } else if (guests_.size() < kGuests) {
      guests_.push_back({std::move(fd), {}, monotonic_now()});
    }
  }
}

void SocketTransport::fill() {
  std::array<std::uint8_t, 4096> piece{};
  while (peer_ && in_.size() < kRoom) {
    const ssize_t got = ::recv(peer_.get(), piece.data(), piece.size(), 0);
    if (got > 0) {
      in_.insert(in_.end(), piece.begin(), piece.begin() + got);
      continue;
    }
    if (got < 0 && again(errno)) return;
    hang_up();
  }
}

void SocketTransport::flush() {
  while (peer_ && !out_.empty()) {
    const ssize_t sent = ::send(peer_.get(), out_.data(), out_.size(), MSG_NOSIGNAL);
    if (sent > 0) {
      out_.erase(out_.begin(), out_.begin() + sent);
      continue;
    }
    if (sent < 0 && again(errno)) return;
    hang_up();
  }
}

void SocketTransport::hang_up() {
  peer_.close();
  left_ = true;
  forget();
}

void SocketTransport::turn_away() {
  BufferedTransport::turn_away();
  hang_up();
}

void SocketTransport::answer_guests() {
  std::array<std::uint8_t, 1024> piece{};
  std::erase_if(guests_, [&piece](Guest& guest) {
    const ssize_t got = ::recv(guest.fd.get(), piece.data(), piece.size(), 0);
    if (got < 0 && again(errno)) return monotonic_now() - guest.since > kGuestPatience;
    if (got <= 0) return true;
    const protocol::ByteView answer = guest.busy.take({piece.data(), static_cast<std::size_t>(got)});
    if (answer.size == 0) return false;
    ::send(guest.fd.get(), answer.data, answer.size, MSG_NOSIGNAL);
    return true;
  });
}

}  // namespace symrig::board_linux
