// SPDX-License-Identifier: Apache-2.0
// The ways to a board. open_link() chooses one by the uri.
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/link.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

namespace symrig::board {

/// Raw wire bytes over a descriptor, in real time. restart_time: Link::restart_time().
std::unique_ptr<Link> make_stream_link(Fd fd, std::string name, Nanoseconds restart_time = Nanoseconds{0});

/// Opens a serial port raw (8N1, no echo, no flow control by characters), for this program only, with DTR and
/// RTS on. Discards bytes that arrived before. fails: device_lost (missing, no permission, in use),
/// bad_argument (not a serial port, an unknown baud rate).
Result<Fd> open_serial(const std::string& path, std::uint32_t baud);

/// A non-blocking connection to a listening local socket. fails: device_lost, bad_argument (path too long).
Result<Fd> connect_unix(const std::string& path);

/// A non-blocking connection to a TCP port, with Nagle's delay off. Tries every address of the host, each for
/// at most `patience`. fails: device_lost (no such host, refused, no answer).
Result<Fd> connect_tcp(const std::string& host, std::uint16_t port, Nanoseconds patience);

/// A listening local socket, for this user only. fails: io (something is at this path), bad_argument (it does
/// not fit).
Result<Fd> listen_unix(const std::string& path);
/// A listening TCP port of this machine. fails: io (in use), bad_argument (a host of another machine).
Result<Fd> listen_here(const std::string& host, std::uint16_t port);
/// A listening TCP port of an address of this machine, which other machines can reach. fails: io (no such
/// address, in use).
Result<Fd> listen_tcp(const std::string& host, std::uint16_t port);

/// Claims the vendor interface of the board whose serial number begins with `serial`. fails: device_lost (no
/// such board, no permission, in use), bad_argument (several match), io (no USB).
Result<std::unique_ptr<Link>> open_usb(const std::string& serial);

/// A link that owns a new simulated board. The board has a projector and a camera, or instead of them the
/// uri's jumper. fails: unknown_name (a line of the jumper).
Result<std::unique_ptr<Link>> open_sim_device(const DeviceUri& uri);

/// A socket that listens. A local one is removed with the object.
class ListeningPlace {
 public:
  /// place: "unix:PATH", which must not exist, or "tcp:HOST:PORT" with a HOST of this machine.
  /// fails: bad_argument (another place), io (the socket cannot be made).
  static Result<ListeningPlace> open(const std::string& place);
  /// The same, and any address of this machine: other machines then reach it. Only for a server that demands
  /// a secret.
  static Result<ListeningPlace> open_to_network(const std::string& place);
  ListeningPlace(ListeningPlace&& other) noexcept
      : fd_(std::move(other.fd_)), file_(std::exchange(other.file_, {})) {}
  ListeningPlace& operator=(ListeningPlace&&) = delete;
  ~ListeningPlace();

  int fd() const { return fd_.get(); }
  /// The next client that waits, without blocking, without Nagle's delay; none: nobody waits.
  Fd accept() const;

 private:
  ListeningPlace(Fd fd, std::string file) : fd_(std::move(fd)), file_(std::move(file)) {}

  Fd fd_;
  std::string file_;  // of a local socket
};

}  // namespace symrig::board
