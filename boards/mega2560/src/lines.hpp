// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <avr/io.h>
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::mega2560 {

// Lines 0 to 5 are PA0 to PA5: one store sets all outputs. Lines 6 to 11 are inputs with an interrupt each:
// INT0 to INT3 (PD0 to PD3), INT4 and INT5 (PE4, PE5).
constexpr uint8_t kOutputs = 6;
constexpr uint8_t kLines = 12;
constexpr uint8_t kOutputMask = 0x3F;

/// Present levels of the inputs: bit k is line kOutputs + k.
inline uint8_t input_levels() {
  return static_cast<uint8_t>((PIND & 0x0FU) | (PINE & 0x30U));
}
/// Present level of one input.
template <uint8_t input>
inline bool input_level() {
  return ((input < 4 ? PIND : PINE) & (1U << input)) != 0;
}
/// Present levels of the output pins, bit k is line k.
inline uint8_t output_levels() {
  return PINA & kOutputMask;
}

}  // namespace symrig::mega2560
