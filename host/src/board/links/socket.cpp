// SPDX-License-Identifier: Apache-2.0
#include "board/links/links.hpp"
#include "symrig/base/files.hpp"

#include <cerrno>
#include <cstring>
#include <memory>

#include <fcntl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

namespace symrig::board {
namespace {

Error unreachable(const std::string& place, std::string_view why) {
  return {ErrorCode::device_lost, fmt::format("{} cannot be reached ({})", place, why),
          "check that a board's server runs there"};
}

/// 0 or the errno of a connection in progress on a non-blocking socket.
int outcome(int fd, Nanoseconds patience) {
  pollfd one{fd, POLLOUT, 0};
  const auto milliseconds = std::chrono::ceil<std::chrono::milliseconds>(patience).count();
  int ready = 0;
  do {
    ready = ::poll(&one, 1, static_cast<int>(milliseconds));
  } while (ready < 0 && errno == EINTR);
  if (ready < 0) return errno;
  if (ready == 0) return ETIMEDOUT;
  int error = 0;
  socklen_t size = sizeof(error);
  return ::getsockopt(fd, SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : errno;
}

/// 0 or an errno.
int connect_within(int fd, const sockaddr* address, socklen_t size, Nanoseconds patience) {
  if (::connect(fd, address, size) == 0) return 0;
  return errno == EINPROGRESS || errno == EINTR ? outcome(fd, patience) : errno;
}

struct FreeAddresses {
  void operator()(addrinfo* list) const { ::freeaddrinfo(list); }
};

}  // namespace

Result<Fd> connect_unix(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path))
    return Error{ErrorCode::bad_argument, fmt::format("unix:{}: the path is too long for a socket", path),
                 fmt::format("use one of at most {} bytes", sizeof(address.sun_path) - 1)};
  std::memcpy(address.sun_path, path.data(), path.size());
  Fd fd(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) return unreachable(path, std::strerror(errno));
  // A local socket connects at once or fails; if its queue of waiting clients is full, it fails with EAGAIN.
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how sockets take addresses
  if (::connect(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    return unreachable(path, std::strerror(errno));
  return fd;
}

Result<Fd> connect_tcp(const std::string& host, std::uint16_t port, Nanoseconds patience) {
  const std::string place = fmt::format("{}:{}", host, port);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found); code != 0)
    return unreachable(place, ::gai_strerror(code));
  const std::unique_ptr<addrinfo, FreeAddresses> addresses(found);
  int error = EADDRNOTAVAIL;
  for (const addrinfo* one = found; one != nullptr; one = one->ai_next) {
    Fd fd(::socket(one->ai_family, one->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, one->ai_protocol));
    error = fd ? connect_within(fd.get(), one->ai_addr, one->ai_addrlen, patience) : errno;
    if (error != 0) continue;
    const int on = 1;
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    return fd;
  }
  return unreachable(place, std::strerror(error));
}

}  // namespace symrig::board
