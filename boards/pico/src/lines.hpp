// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::pico {

/// Present levels of all lines, bit k = line k.
uint32_t line_levels();

}  // namespace symrig::pico
