// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/byte_link.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <poll.h>

namespace symrig::board_linux {

/// A link to the host. No call blocks: the main loop sleeps on the descriptors of watch(), then calls
/// serve().
class Transport : public hal::ByteLink {
 public:
  Transport() = default;
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  virtual ~Transport() = default;

  virtual const std::string& name() const = 0;  ///< for the log: "unix:/run/symrig/board.sock"
  virtual void watch(std::vector<pollfd>& fds) const = 0;
  /// Receives and sends bytes, and notices hosts that connect or disconnect.
  virtual void serve() = 0;
  /// Bytes from the host wait to be read.
  virtual bool pending() const = 0;
  /// Another host has the board: answers "busy" to the first waiting request, and discards it.
  virtual void turn_away() = 0;
};

/// A link with buffers in both directions.
class BufferedTransport : public Transport {
 public:
  std::size_t read(std::uint8_t* out, std::size_t room) override;
  std::size_t room() const override;
  void write(const std::uint8_t* bytes, std::size_t size) override;
  bool pending() const override { return !in_.empty(); }
  void turn_away() override;

 protected:
  static constexpr std::size_t kRoom = 65'536;

  /// Sends as much of out_ as possible.
  virtual void flush() = 0;
  /// read() calls it when there is space in in_ again.
  virtual void drained() {}
  void forget() {
    in_.clear();
    out_.clear();
  }

  std::vector<std::uint8_t> in_;
  std::vector<std::uint8_t> out_;
};

}  // namespace symrig::board_linux
