// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scratch.hpp"
#include "symrig/boards/sim_board.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <map>
#include <optional>
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

/// A simulated board behind the virtual link, as docs/howto-boards.md writes it down: the pins are the lines,
/// 8 ns a cycle. What a client may expect of any such server, an emulator's included.
class VirtualServer final : public board_sim::Peripheral {
 public:
  explicit VirtualServer(std::uint32_t version = 1) : version_(version) { board_.attach(*this); }

  /// Serves one client until it closes.
  void serve(int fd, const std::atomic<bool>& stop) {
    std::vector<std::uint8_t> bytes, waiting;
    while (!stop && read_some(fd, bytes)) {
      waiting.insert(waiting.end(), bytes.begin(), bytes.end());
      while (waiting.size() >= 5 && waiting.size() >= 5 + number(waiting, 1, 4)) {
        const std::size_t size = 5 + number(waiting, 1, 4);
        answer(fd, static_cast<char>(waiting[0]), std::span(waiting).subspan(5, size - 5));
        waiting.erase(waiting.begin(), waiting.begin() + static_cast<std::ptrdiff_t>(size));
      }
    }
  }

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, board_sim::SimBoard&) override {
    for (std::uint8_t pin = 0; pin < 28; ++pin) {
      if (((levels ^ levels_) >> pin & 1U) == 0) continue;
      const bool level = (levels >> pin & 1U) != 0;
      note(tick, pin, level);
      if (const auto wire = jumpers_.find(pin); wire != jumpers_.end()) drive(tick, wire->second, level);
    }
    levels_ = levels;
  }
  std::uint64_t next_event() const override { return pulse_ ? pulse_->next : board_sim::kNever; }
  void on_event(std::uint64_t tick, board_sim::SimBoard&) override {
    pulse_->high = !pulse_->high;
    drive(tick, pulse_->pin, pulse_->high);
    pulse_->next += pulse_->high ? pulse_->width : pulse_->period - pulse_->width;
  }

 private:
  struct Pulse {
    std::uint8_t pin;
    std::uint64_t period, width, next;
    bool high;
  };
  using Bytes = std::span<const std::uint8_t>;

  static std::uint64_t number(Bytes bytes, std::size_t at, std::size_t size) {
    std::uint64_t value = 0;
    for (std::size_t k = 0; k < size; ++k) value |= std::uint64_t{bytes[at + k]} << (8 * k);
    return value;
  }
  static void append(std::vector<std::uint8_t>& bytes, std::uint64_t value, std::size_t size) {
    for (std::size_t k = 0; k < size; ++k) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
  }

  void note(std::uint64_t tick, std::uint8_t pin, bool level) {
    append(edges_, tick, 8);
    edges_.push_back(pin);
    edges_.push_back(level ? 1 : 0);
  }
  void drive(std::uint64_t tick, std::uint8_t pin, bool level) {
    board_.set_input(pin, level);
    note(tick, pin, level);
  }

  std::vector<std::uint8_t> now_payload() const {
    std::vector<std::uint8_t> payload;
    append(payload, board_.now() * 8, 8);
    return payload;
  }

  /// Time passes until bytes are there or the timeout is over.
  std::vector<std::uint8_t> run(std::uint64_t timeout_ns) {
    const std::uint64_t deadline = board_.now() + timeout_ns / 8;
    std::vector<std::uint8_t> bytes = board_.read();
    while (bytes.empty() && board_.next_event() <= deadline) {
      board_.advance();
      bytes = board_.read();
    }
    if (bytes.empty()) board_.advance_to(deadline);
    std::vector<std::uint8_t> payload = now_payload();
    payload.insert(payload.end(), bytes.begin(), bytes.end());
    return payload;
  }

  void wire(std::uint8_t from, std::uint8_t to) {
    if (from == 255) {
      jumpers_.clear();
    } else {
      jumpers_[from] = to;
      board_.set_input(to, (levels_ >> from & 1U) != 0);
    }
  }
  void pulse(std::uint8_t pin, std::uint64_t period_ns, std::uint64_t width_ns) {
    pulse_.reset();
    if (period_ns > 0) pulse_ = Pulse{pin, period_ns / 8, width_ns / 8, board_.now(), false};
  }

  static void reply(int fd, char type, Bytes payload) {
    std::vector<std::uint8_t> message{static_cast<std::uint8_t>(type)};
    append(message, payload.size(), 4);
    message.insert(message.end(), payload.begin(), payload.end());
    write_all(fd, message);
  }

  void answer(int fd, char type, Bytes payload) {
    if (const auto text = objection(type)) {
      reply(fd, 'x', {reinterpret_cast<const std::uint8_t*>(text->data()), text->size()});
    } else {
      reply(fd, type, act(type, payload));
    }
  }

  static std::optional<std::string> objection(char type) {
    if (std::string("hwrnijvedp").find(type) != std::string::npos) return std::nullopt;
    return std::string("no request '") + type + "': this is a simulated board";
  }

  std::vector<std::uint8_t> act(char type, Bytes payload) {
    switch (type) {
      case 'h':
        return hello();
      case 'r':
        return run(number(payload, 0, 8) + 7);  // to the end of the last cycle
      case 'n':
        return now_payload();
      case 'e':
        return std::exchange(edges_, {});
      case 'w':
        board_.write(payload);
        break;
      case 'i':
        if (payload[1] < 2) drive(board_.now(), payload[0], payload[1] == 1);
        break;
      case 'j':
        wire(payload[0], payload[1]);
        break;
      case 'v':
        pulse(payload[0], number(payload, 1, 8), number(payload, 9, 8));
        break;
      case 'd':
        board_.set_attached(payload[0] == 1);
        break;
      default:
        board_.reboot();
        break;
    }
    return {};
  }

  std::vector<std::uint8_t> hello() const {
    std::vector<std::uint8_t> payload;
    append(payload, version_, 4);
    append(payload, board_.config().tick_hz, 8);
    for (const char letter : std::string("sim-virtual")) payload.push_back(static_cast<std::uint8_t>(letter));
    return payload;
  }

  std::uint32_t version_;
  board_sim::SimBoard board_;
  std::uint32_t levels_ = 0;
  std::map<std::uint8_t, std::uint8_t> jumpers_;
  std::optional<Pulse> pulse_;
  std::vector<std::uint8_t> edges_;
};

}  // namespace symrig::test
