// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace symrig::board_linux {

/// The first data to write to a FunctionFS's ep0. They describe the vendor interface of every symrig board:
/// one bulk endpoint in each direction, full and high speed. They also select the WinUSB driver on Windows.
/// The kernel needs Microsoft OS 1.0 descriptors for that; the Pico has version 2.0 with the same GUID.
/// microsoft: the descriptors' version that this kernel expects (0x0100; older kernels 1), 0 = none.
/// Then file ep1 is the endpoint from the host, and ep2 the one to the host.
std::vector<std::uint8_t> ffs_descriptors(unsigned microsoft);
/// The interface's name.
std::vector<std::uint8_t> ffs_strings();

}  // namespace symrig::board_linux
