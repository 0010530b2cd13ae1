// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/byte_link.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <poll.h>

namespace symrig::board_linux {

/// A way to the host. Nothing here waits: the main loop sleeps on what watch() names, then calls serve().
class Transport : public hal::ByteLink {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  virtual const std::string& name() const = 0;  ///< for the log: "unix:/run/symrig/board.sock"
  virtual void watch(std::vector<pollfd>& fds) const = 0;
  /// Takes what has come, sends what is left, notices hosts that come and go.
  virtual void serve() = 0;
  /// Bytes from the host wait to be read.
  virtual bool pending() const = 0;
  /// Another host has the board: the first request that waits is answered so, and forgotten.
  virtual void turn_away() = 0;
};

/// Bytes on their way, both ways.
class BufferedTransport : public Transport {
 public:
  std::size_t read(std::uint8_t* out, std::size_t room) override;
  std::size_t room() const override;
  void write(const std::uint8_t* bytes, std::size_t size) override;
  bool pending() const override { return !in_.empty(); }
  void turn_away() override;

 protected:
  static constexpr std::size_t kRoom = 65'536;

  /// Sends what stands in out_, as far as it goes.
  virtual void flush() = 0;
  /// Called when read() has made room in in_.
  virtual void drained() {}
  void forget() {
    in_.clear();
    out_.clear();
  }

  std::vector<std::uint8_t> in_;
  std::vector<std::uint8_t> out_;
};

}  // namespace symrig::board_linux
