// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"
#include "transport.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include <linux/aio_abi.h>

namespace symrig::board_linux {

/// A transfer and its memory. It must not move while the transfer runs.
struct Transfer {
  std::vector<std::uint8_t> buffer;
  iocb request{};
  bool busy = false;
  bool input = false;
};

/// How a transfer ended.
struct Completed {
  Transfer* transfer = nullptr;
  std::int64_t result = 0;  ///< bytes, or a negated errno
};

/// The kernel's asynchronous reads and writes. For files whose reads block in spite of O_NONBLOCK, as
/// FunctionFS endpoints do. Its descriptor is readable when transfers have ended.
class AioQueue {
 public:
  /// fails: io.
  static Result<AioQueue> make(unsigned transfers);
  AioQueue(AioQueue&& other) noexcept;
  AioQueue& operator=(AioQueue&&) = delete;
  AioQueue(const AioQueue&) = delete;
  AioQueue& operator=(const AioQueue&) = delete;
  /// Cancels the running transfers, and waits for their end.
  ~AioQueue();

  int fd() const { return bell_.get(); }
  /// Reads up to `size` bytes into the transfer's buffer, or writes its first `size` bytes. false: refused.
  bool submit(Transfer& transfer, int fd, std::size_t size, bool input);
  /// The transfers that have ended, in order; may be empty. Valid until the next call.
  std::span<const Completed> completed();
  void quiet() const;

 private:
  AioQueue(aio_context_t context, Fd bell) : context_(context), bell_(std::move(bell)) {}

  aio_context_t context_ = 0;
  Fd bell_;
  std::array<Completed, 32> completed_{};
};

/// The board as a USB device, through a mounted FunctionFS (libexec/symrig-gadget sets it up). Attached while
/// a host has configured the device and has not suspended it.
class UsbTransport final : public BufferedTransport {
 public:
  /// Writes the descriptors. After that the gadget may be bound to a controller.
  /// fails: not_found (nothing mounted), device_refused (no permission, another daemon uses it), io.
  static Result<std::unique_ptr<UsbTransport>> open(const std::string& mount);

  const std::string& name() const override { return name_; }
  void watch(std::vector<pollfd>& fds) const override;
  void serve() override;
  bool attached() const override { return enabled_ && !asleep_; }

 private:
  // One packet per read. A longer read would end only with a short packet, and a frame may consist of full
  // packets.
  static constexpr std::size_t kReads = 16;
  static constexpr std::size_t kWrites = 8;
  static constexpr std::size_t kPiece = 4096;
  static constexpr std::size_t kLongestPacket = 1024;

  UsbTransport(std::string name, Fd control, Fd out, Fd in, AioQueue aio);
  void take_events();
  void take_event(unsigned type, bool to_host);
  void collect();
  void read_on();
  void flush() override;
  void drained() override { read_on(); }
  bool write_piece();

  std::string name_;
  Fd control_;  // ep0
  Fd from_;     // ep1: from the host
  Fd to_;       // ep2: to the host
  std::array<Transfer, kReads> reads_;
  std::array<Transfer, kWrites> writes_;
  AioQueue aio_;  // declared after the transfers: its destructor waits for them
  std::size_t next_read_ = 0;
  std::size_t next_write_ = 0;
  std::size_t packet_ = 64;
  bool close_with_empty_ = false;  // the last data sent filled whole packets
  bool enabled_ = false;
  bool asleep_ = false;
};

}  // namespace symrig::board_linux
