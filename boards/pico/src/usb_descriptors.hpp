// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// What the device says of itself: a vendor interface (bulk, the wire) and a CDC-ACM console (the log), with
/// the Microsoft OS 2.0 descriptors that give the vendor interface the WinUSB driver.
namespace symrig::pico::usb_descriptors {

/// Endpoints.
constexpr uint8_t kWire = 1;             // bulk, both ways
constexpr uint8_t kNotice = 2;           // interrupt, to the host: never used, but CDC wants it
constexpr uint8_t kConsole = 3;          // bulk, both ways
constexpr uint8_t kMsVendorCode = 0x20;  // bRequest that asks for the Microsoft descriptors

/// Bytes that live for ever.
struct Bytes {
  const uint8_t* data = nullptr;
  uint16_t size = 0;
};

Bytes device();
Bytes configuration();
Bytes bos();
Bytes microsoft();
/// A string as ASCII; nullptr if there is none of that number. serial: what string 3 is.
const char* string(uint8_t number, const char* serial);

}  // namespace symrig::pico::usb_descriptors
