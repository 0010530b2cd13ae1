// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <avr/interrupt.h>
#include <avr/io.h>
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::mega2560 {

/// No interrupt comes while it lives.
class IrqLock {
 public:
  IrqLock() : status_(SREG) {
    cli();
    asm volatile("" ::: "memory");
  }
  ~IrqLock() {
    asm volatile("" ::: "memory");
    SREG = status_;
  }
  IrqLock(const IrqLock&) = delete;
  IrqLock& operator=(const IrqLock&) = delete;

 private:
  uint8_t status_;
};

}  // namespace symrig::mega2560
