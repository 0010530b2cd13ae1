// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/firmware/core.hpp"
#include "usb_device.hpp"

namespace symrig::pico {

/// The log on the USB serial port: the start, each change of state, each fault. Never waits. Characters that
/// do not fit are counted and reported later.
class Console {
 public:
  Console(UsbDevice& usb, const firmware::Core& core) : usb_(usb), core_(core) {}

  void greet(hal::ResetCause cause);
  /// Reports what has changed since the last call.
  void service();

 private:
  void line(const char* first, const char* second);
  void line(const char* text, uint64_t number);
  void print(const char* text);

  UsbDevice& usb_;
  const firmware::Core& core_;
  firmware::State told_state_ = firmware::State::boot;
  uint32_t told_fault_ = 0;
  uint32_t lost_ = 0;  // characters lost since the last report
};

}  // namespace symrig::pico
