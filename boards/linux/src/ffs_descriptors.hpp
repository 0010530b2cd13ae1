// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace symrig::board_linux {

/// What is written to a FunctionFS's ep0 before anything else: the vendor interface of every symrig board
/// (one bulk endpoint each way, full and high speed), and what gives it the WinUSB driver on Windows. The
/// kernel takes the latter as Microsoft OS 1.0 descriptors; the Pico's are 2.0, with the same GUID.
/// microsoft: the version that this kernel wants them to have (0x0100; older ones 1), 0 = leave them out.
/// File ep1 is then the endpoint from the host, ep2 the one to it.
std::vector<std::uint8_t> ffs_descriptors(unsigned microsoft);
/// The interface's name.
std::vector<std::uint8_t> ffs_strings();

}  // namespace symrig::board_linux
