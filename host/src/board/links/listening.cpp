// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/internal/links.hpp"

#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
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

/// The path fits.
sockaddr_un unix_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  return address;
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

/// Whether the socket is there and nobody listens.
bool refuses(const std::string& path) {
  const sockaddr_un address = unix_address(path);
  const Fd probe(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): how sockets take addresses
  const int failed = ::connect(probe.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address));
  return failed != 0 && errno == ECONNREFUSED;
}

/// Removes the socket of a server that was killed: nobody listens there. A server that has just started
/// listens a moment after its socket appears, so it is asked twice. Any other file stays.
void remove_left_socket(const std::string& path) {
  constexpr int kAsked = 2;
  constexpr useconds_t kStart = 100'000;  // us
  for (int k = 0; k < kAsked; ++k) {
    struct stat status {};
    if (::lstat(path.c_str(), &status) != 0 || !S_ISSOCK(status.st_mode)) return;
    if (k > 0) ::usleep(kStart);
    if (!refuses(path)) return;
  }
  ::unlink(path.c_str());
}

}  // namespace

Result<Fd> listen_unix(const std::string& path) {
  const std::string place = "unix:" + path;
  constexpr std::size_t kLongest = sizeof(sockaddr_un::sun_path) - 1;
  if (path.empty() || path.size() > kLongest)
    return Error{ErrorCode::bad_argument, fmt::format("{}: the path does not fit a socket", place),
                 fmt::format("use one of 1 to {} bytes", kLongest)};
  remove_left_socket(path);
  SYMRIG_TRY(Fd fd, bound(unix_address(path), AF_UNIX, place));
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

Result<ListeningPlace> ListeningPlace::open(const std::string& place) {
  const auto uri = DeviceUri::parse(place);
  const bool local = uri && uri->transport == Transport::unix_socket;
  if (!local && !(uri && uri->transport == Transport::tcp))
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is no place to listen at", place),
                 "give unix:PATH or tcp:127.0.0.1:PORT"};
  SYMRIG_TRY(Fd fd, local ? listen_unix(uri->place) : listen_here(uri->place, uri->port));
  return ListeningPlace(std::move(fd), local ? uri->place : std::string());
}

Result<ListeningPlace> ListeningPlace::open_to_network(const std::string& place) {
  const auto uri = DeviceUri::parse(place);
  if (!uri || uri->transport != Transport::tcp) return open(place);
  SYMRIG_TRY(Fd fd, listen_tcp(uri->place, uri->port));
  return ListeningPlace(std::move(fd), {});
}

ListeningPlace::~ListeningPlace() {
  if (!file_.empty()) ::unlink(file_.c_str());
}

Fd ListeningPlace::accept() const {
  Fd client(::accept4(fd_.get(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
  const int on = 1;  // of no effect, and no matter, on a local socket
  if (client) ::setsockopt(client.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
  return client;
}

}  // namespace symrig::board
