// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/types.hpp"

namespace symrig::hal {

/// Bytes to and from the host (USB, UART, memory). Never waits.
class ByteLink {
 public:
  /// Takes at most `room` bytes that have come in. Returns how many.
  virtual size_t read(uint8_t* out, size_t room) = 0;
  /// Bytes that write() would take now.
  virtual size_t room() const = 0;
  /// Sends `size` bytes, at most room().
  virtual void write(const uint8_t* bytes, size_t size) = 0;
  /// The host's end is there (USB configured and not suspended; a UART is always there).
  virtual bool attached() const = 0;

 protected:
  ~ByteLink() = default;
};

}  // namespace symrig::hal
