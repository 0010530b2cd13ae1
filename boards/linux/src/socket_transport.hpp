// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/protocol/messages.hpp"
#include "transport.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// A listening socket that serves one host at a time. Other hosts may connect, get "busy", and are
/// disconnected.
class SocketTransport final : public BufferedTransport {
 public:
  /// A Unix socket that its user and group may open. Replaces the socket of a dead daemon.
  /// fails: bad_argument (path too long), device_refused (another daemon responds there), io.
  static Result<std::unique_ptr<SocketTransport>> listen_unix(const std::string& path);
  /// fails: bad_argument (no such address), io (for example, the port is in use).
  static Result<std::unique_ptr<SocketTransport>> listen_tcp(const std::string& host, std::uint16_t port);
  ~SocketTransport() override;

  const std::string& name() const override { return name_; }
  void watch(std::vector<pollfd>& fds) const override;
  void serve() override;
  bool attached() const override { return static_cast<bool>(peer_); }
  void turn_away() override;

 private:
  struct Guest {
    Fd fd;
    protocol::BusyAnswer busy;
    std::uint64_t since = 0;
  };

  SocketTransport(Fd listener, std::string name, std::string path)
      : listener_(std::move(listener)), name_(std::move(name)), path_(std::move(path)) {}
  void accept_hosts();
  void fill();
  void flush() override;
  void answer_guests();
  void hang_up();

  Fd listener_;
  std::string name_;
  std::string path_;  // of a Unix socket, to remove it
  Fd peer_;
  std::vector<Guest> guests_;
  bool left_ = false;  // a host disconnected after the last serve()
};

}  // namespace symrig::board_linux
