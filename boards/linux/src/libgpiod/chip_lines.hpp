// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// One line of a GPIO chip. Texts are empty where the kernel has none.
struct LineInfo {
  std::string name;
  std::string consumer;  ///< who holds the line
  bool used = false;     ///< requested by a program, or used by the kernel
};

/// Everything that the daemon asks of libgpiod: all lines of a chip, by offset. libgpiod 1.6 and 2 share no
/// function that tells it. chip_lines_v1.cpp uses 1.6 (Debian 12), chip_lines_v2.cpp uses 2 (Debian 13,
/// Raspberry Pi OS of 2025). CMake compiles the file for the version that pkg-config finds.
/// path: the character device, such as /dev/gpiochip0.
/// fails: nullopt, with the cause in errno (EACCES and EPERM: no permission).
std::optional<std::vector<LineInfo>> chip_lines(const std::string& path);

}  // namespace symrig::board_linux
