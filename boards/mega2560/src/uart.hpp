// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "edge_engine.hpp"
#include "symrig/firmware/link.hpp"
#include "symrig/hal/peripherals.hpp"

namespace symrig::mega2560 {

/// USART 0, which the Arduino board connects to its USB port: 115,200 baud, 8 bits, no parity (data sheet
/// section 22). It cannot detect a host, so a run with hazardous lines needs a keep-alive.
class Uart final : public hal::ByteLink {
 public:
  explicit Uart(MegaEngine& engine) : engine_(engine) {}

  static void begin();
  // hal::ByteLink
  size_t read(uint8_t* out, size_t room) override;
  size_t room() const override;
  void write(const uint8_t* bytes, size_t size) override;
  bool attached() const override { return true; }

  // From interrupts. A byte without room is lost: the frame's CRC then fails, and the host repeats it.
  void received(uint8_t byte);
  void may_send();

 private:
  static constexpr uint8_t kIn = 128;   // powers of two
  static constexpr uint8_t kOut = 192;  // one reply, and some events

  MegaEngine& engine_;
  firmware::UrgentScan scan_;
  volatile uint8_t in_[kIn] = {};  // volatile, so that a byte is there before its index
  volatile uint8_t in_put_ = 0;
  volatile uint8_t in_taken_ = 0;
  volatile uint8_t out_[kOut] = {};
  volatile uint8_t out_put_ = 0;
  volatile uint8_t out_taken_ = 0;
};

}  // namespace symrig::mega2560
