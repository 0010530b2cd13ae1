// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::pico {

/// A function of the boot ROM by its two-letter name; 0 if the ROM has none.
uint32_t rom_function(char first, char second);

}  // namespace symrig::pico
