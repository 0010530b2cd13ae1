// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::pico {

/// Levels of all lines now, bit k = line k.
uint32_t line_levels();

}  // namespace symrig::pico
