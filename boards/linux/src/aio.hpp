// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
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

}  // namespace symrig::board_linux
