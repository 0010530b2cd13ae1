// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "symrig/hal/clock.hpp"
#include "symrig/hal/peripherals.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
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

/// Joins all links to one. The first host that sends something gets the board until it disconnects; others
/// get "busy". USB and serial links do not show that a program has ended. So their host loses the board if it
/// has been silent for five seconds and another one sends something.
class LinkSwitch final : public hal::ByteLink {
 public:
  explicit LinkSwitch(std::vector<std::unique_ptr<Transport>> transports)
      : transports_(std::move(transports)) {}

  std::size_t read(std::uint8_t* out, std::size_t room) override;
  std::size_t room() const override { return holder_ != nullptr ? holder_->room() : 0; }
  void write(const std::uint8_t* bytes, std::size_t size) override;
  bool attached() const override { return holder_ != nullptr && holder_->attached(); }

  void watch(std::vector<pollfd>& fds) const;
  /// Serves every link and decides who has the board at `now`. Returns true if that changed. The firmware
  /// must then poll once without a host, to discard an incomplete message of the last host.
  bool serve(hal::Tick now);
  /// Name of the link that has the board; empty: none.
  std::string holder() const { return holder_ != nullptr ? holder_->name() : std::string(); }
  bool pending() const { return holder_ != nullptr && holder_->pending(); }

 private:
  static constexpr hal::Tick kSilence = 5'000'000'000;

  Transport* first_speaker() const;

  std::vector<std::unique_ptr<Transport>> transports_;
  Transport* holder_ = nullptr;
  hal::Tick heard_ = 0;
};

/// A serial port in raw mode: a UART, or a gadget's (/dev/ttyGS0). The host counts as attached while the port
/// exists.
class SerialTransport final : public BufferedTransport {
 public:
  /// fails: bad_argument (rate not possible, not a serial port), device_refused (no permission, in use), io.
  static Result<std::unique_ptr<SerialTransport>> open(const std::string& path, std::uint32_t baud);

  const std::string& name() const override { return name_; }
  void watch(std::vector<pollfd>& fds) const override;
  void serve() override;
  bool attached() const override { return static_cast<bool>(port_); }

 private:
  SerialTransport(Fd port, std::string name) : port_(std::move(port)), name_(std::move(name)) {}
  void flush() override;
  void hang_up();

  Fd port_;
  std::string name_;
};

}  // namespace symrig::board_linux
