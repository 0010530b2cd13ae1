// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// Bytes to and from the host (USB, UART, memory). Never waits.
class ByteLink {
 public:
  /// Reads at most `room` received bytes. Returns their number.
  virtual size_t read(uint8_t* out, size_t room) = 0;
  /// The number of bytes that write() accepts now.
  virtual size_t room() const = 0;
  /// Sends `size` bytes, at most room().
  virtual void write(const uint8_t* bytes, size_t size) = 0;
  /// True if a host is connected (USB configured and not suspended; always true for a UART).
  virtual bool attached() const = 0;

 protected:
  ~ByteLink() = default;
};

}  // namespace symrig::hal
