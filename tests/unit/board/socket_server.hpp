// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scratch.hpp"

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

namespace symrig::test {

using symrig::test::Scratch;

/// A listening local socket, or a TCP port of the loop-back that the system chose.
class Listener {
 public:
  static Listener local(const std::string& path) {
    Listener one(AF_UNIX);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.data(), path.size());
    one.listen_at(reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    return one;
  }
  static Listener tcp() {
    Listener one(AF_INET);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    one.listen_at(reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    return one;
  }
  Listener(Listener&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Listener& operator=(Listener&&) = delete;
  ~Listener() { close(fd_); }

  std::uint16_t port() const {
    sockaddr_in address{};
    socklen_t size = sizeof(address);
    EXPECT_EQ(getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    return ntohs(address.sin_port);
  }
  /// Does a client wait, within `milliseconds`?
  bool ready(int milliseconds) const {
    pollfd one{fd_, POLLIN, 0};
    return poll(&one, 1, milliseconds) > 0;
  }
  /// The next client's descriptor.
  int accept() const { return ::accept(fd_, nullptr, nullptr); }
  /// The same, or -1 if none comes within `patience`.
  int accept_within(std::chrono::milliseconds patience) const {
    pollfd one{fd_, POLLIN, 0};
    return poll(&one, 1, static_cast<int>(patience.count())) > 0 ? accept() : -1;
  }

 private:
  explicit Listener(int family) : fd_(socket(family, SOCK_STREAM, 0)) {}
  void listen_at(const sockaddr* address, socklen_t size) const {
    EXPECT_EQ(bind(fd_, address, size), 0) << std::strerror(errno);
    EXPECT_EQ(listen(fd_, 4), 0);
  }

  int fd_;
};

/// Reads what is there within a millisecond. false: the other end has closed.
inline bool read_some(int fd, std::vector<std::uint8_t>& bytes) {
  bytes.clear();
  pollfd one{fd, POLLIN, 0};
  if (poll(&one, 1, 1) <= 0) return true;
  bytes.resize(4096);
  const ssize_t count = ::read(fd, bytes.data(), bytes.size());
  bytes.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  return count > 0;
}

inline void write_all(int fd, std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = write(fd, bytes.data(), bytes.size());
    if (sent <= 0) return;
    bytes = bytes.subspan(sent);
  }
}

/// Runs `serve(fd, stop)` in a thread until it returns; asks it to stop when it goes.
class ServerThread {
 public:
  using Serve = std::function<void(int fd, const std::atomic<bool>& stop)>;

  /// open: gives the descriptor, in the thread (it may wait for a client).
  ServerThread(std::function<int()> open, Serve serve)
      : thread_([this, open = std::move(open), serve = std::move(serve)] {
          const int fd = open();
          serve(fd, stop_);
          close(fd);
        }) {}
  ServerThread(const ServerThread&) = delete;
  ServerThread& operator=(const ServerThread&) = delete;
  ~ServerThread() { end(); }

  void end() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace symrig::test
