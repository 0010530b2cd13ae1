// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// The device's descriptors: a vendor interface (bulk, the wire), a CDC-ACM console (the log), and Microsoft
/// OS 2.0 descriptors that select the WinUSB driver for the vendor interface.
namespace symrig::pico::usb_descriptors {

/// Endpoints.
constexpr uint8_t kWire = 1;     // bulk, both ways
constexpr uint8_t kNotice = 2;   // interrupt, to the host: never used, but CDC requires it
constexpr uint8_t kConsole = 3;  // bulk, both ways
constexpr uint8_t kResetInterface = 3;
constexpr uint8_t kMsVendorCode = 0x20;  // bRequest for the Microsoft descriptors

/// Bytes with static lifetime.
struct Bytes {
  const uint8_t* data = nullptr;
  uint16_t size = 0;
};

Bytes device();
Bytes configuration();
Bytes bos();
Bytes microsoft();
/// A string as ASCII; nullptr if there is none with this number. serial: the text of string 3.
const char* string(uint8_t number, const char* serial);

}  // namespace symrig::pico::usb_descriptors
