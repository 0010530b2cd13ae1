// SPDX-License-Identifier: Apache-2.0
#include "chip.hpp"

namespace symrig::pico {
namespace {

/// The ROM is at address 0, which compilers treat as a null pointer. This hides the constant.
uint16_t rom_half(uint32_t address) {
  asm("" : "+r"(address));
  return *reinterpret_cast<const volatile uint16_t*>(address);  // NOLINT(performance-no-int-to-ptr)
}

}  // namespace

uint32_t rom_function(char first, char second) {
  constexpr uint32_t kTable = 0x14;
  constexpr uint32_t kMostEntries = 64;
  const auto code = static_cast<uint16_t>(static_cast<uint8_t>(first) | (static_cast<uint8_t>(second) << 8U));
  uint32_t entry = rom_half(kTable);
  if (entry == 0 || entry == 0xffff) return 0;  // no ROM
  for (uint32_t i = 0; i < kMostEntries && rom_half(entry) != 0; ++i, entry += 4)
    if (rom_half(entry) == code) return rom_half(entry + 2);
  return 0;
}

}  // namespace symrig::pico
