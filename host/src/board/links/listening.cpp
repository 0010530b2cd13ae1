// SPDX-License-Identifier: Apache-2.0
#include "board/links/links.hpp"

#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

namespace symrig::board {
namespace {

constexpr int kWaitingHosts = 64;  // strangers may wait among them

Error no_socket(const std::string& place) {
  return {ErrorCode::io, fmt::format("{}: no socket can be made there ({})", place, std::strerror(errno)),
          errno == EADDRINUSE ? "remove what is there, or give another place" : "give another place"};
}

template <class Address>
Result<Fd> bound(const Address& address, int family, const std::string& place) {
  Fd fd(::socket(family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!fd) return no_socket(place);
  const int on = 1;
  if (family != AF_UNIX) ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how sockets take addresses
  if (::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    return no_socket(place);
  return fd;
}

}  // namespace

Result<Fd> listen_unix(const std::string& path) {
  const std::string place = "unix:" + path;
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(address.sun_path))
    return Error{ErrorCode::bad_argument, fmt::format("{}: the path does not fit a socket", place),
                 fmt::format("use one of 1 to {} bytes", sizeof(address.sun_path) - 1)};
  std::memcpy(address.sun_path, path.data(), path.size());
  SYMRIG_TRY(Fd fd, bound(address, AF_UNIX, place));
  // Nobody can connect before listen().
  if (::chmod(path.c_str(), S_IRUSR | S_IWUSR) == 0 && ::listen(fd.get(), kWaitingHosts) == 0) return fd;
  const Error error = no_socket(place);
  ::unlink(path.c_str());
  return error;
}

Result<Fd> listen_here(const std::string& host, std::uint16_t port) {
  const std::string place = fmt::format("tcp:{}:{}", host, port);
  if (host != "127.0.0.1" && host != "localhost" && host != "::1")
    return Error{ErrorCode::bad_argument, fmt::format("{} is not of this machine only", place),
                 "give tcp:127.0.0.1:PORT; from another machine use ssh -L"};
  Result<Fd> fd = [&]() -> Result<Fd> {
    if (host == "::1") {
      sockaddr_in6 address{};
      address.sin6_family = AF_INET6;
      address.sin6_port = htons(port);
      address.sin6_addr = in6addr_loopback;
      return bound(address, AF_INET6, place);
    }
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    return bound(address, AF_INET, place);
  }();
  if (fd && ::listen(fd->get(), kWaitingHosts) != 0) return no_socket(place);
  return fd;
}

Result<Fd> listen_tcp(const std::string& host, std::uint16_t port) {
  const std::string place = fmt::format("tcp:{}:{}", host, port);
  addrinfo wanted{};
  wanted.ai_socktype = SOCK_STREAM;
  wanted.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  if (const int code = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found); code != 0)
    return Error{ErrorCode::io, fmt::format("{}: there is no such address ({})", place, ::gai_strerror(code)),
                 "give an address of this machine"};
  Fd fd(::socket(found->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, found->ai_protocol));
  const int on = 1;
  const bool listens = fd && ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on)) == 0 &&
                       ::bind(fd.get(), found->ai_addr, found->ai_addrlen) == 0 &&
                       ::listen(fd.get(), kWaitingHosts) == 0;
  const Error error = no_socket(place);
  ::freeaddrinfo(found);
  if (!listens) return error;
  return fd;
}

}  // namespace symrig::board
