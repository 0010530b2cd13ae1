// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"

#include <string>
#include <utility>

namespace symrig::board {

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
