// SPDX-License-Identifier: Apache-2.0
#include "board/links/listening_place.hpp"

#include "board/links/links.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <sys/socket.h>
#include <unistd.h>

namespace symrig::board {

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
