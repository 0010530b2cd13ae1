// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "registers.hpp"

/// Bits and memory of the USB controller, with the names of the data sheet.
namespace symrig::pico::usb {

// Buffer control.
constexpr uint32_t kAvailable = 1U << 10U, kStall = 1U << 11U, kData1 = 1U << 13U, kLast = 1U << 14U,
                   kFull = 1U << 15U;
constexpr uint32_t kLengthMask = 0x3ff;
// SIE_STATUS and interrupts.
constexpr uint32_t kSieSuspended = 1U << 4U, kSieResume = 1U << 11U, kSieSetup = 1U << 17U,
                   kSieReset = 1U << 19U;
constexpr uint32_t kIntBuffer = 1U << 4U, kIntReset = 1U << 12U, kIntSuspend = 1U << 14U,
                   kIntResume = 1U << 15U, kIntSetup = 1U << 16U, kIntFrame = 1U << 17U;
constexpr uint32_t kPullUp = 1U << 16U;  // of SIE_CTRL

// The controller's memory: first control words, then a 64-byte buffer for each direction of each endpoint.
constexpr uint32_t kControlBuffer = 0x100;
constexpr uint32_t buffer(uint32_t endpoint, bool out) {
  return endpoint == 0 ? kControlBuffer : 0x180 + 0x80 * (endpoint - 1) + (out ? 0x40 : 0);
}
inline volatile uint32_t& buffer_control(uint32_t endpoint, bool out) {
  return reg(usb::ram + 0x80 + 8 * endpoint + (out ? 4 : 0));
}
inline volatile uint32_t& endpoint_control(uint32_t endpoint, bool out) {
  return reg(usb::ram + 8 * endpoint + (out ? 4 : 0));
}
constexpr uint32_t buff_status_bit(uint32_t endpoint, bool out) {
  return 1U << (2 * endpoint + (out ? 1 : 0));
}

}  // namespace symrig::pico::usb
