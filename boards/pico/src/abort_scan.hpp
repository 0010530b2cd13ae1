// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stddef.h>  // NOLINT(modernize-deprecated-headers)
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::pico {

/// Does a packet end with an urgent Abort frame (protocol/PROTOCOL.md)? So that the interrupt that receives
/// it can bring the outputs to their safe levels before the main loop comes to read it. Bytes that look like
/// an Abort but fail the CRC are none; an Abort that is cut over two packets is not seen here, and the main
/// loop takes it.
bool ends_with_abort(const uint8_t* bytes, size_t size);

}  // namespace symrig::pico
