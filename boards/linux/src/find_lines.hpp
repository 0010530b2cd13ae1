// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board_file.hpp"
#include "kernel_gpio.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace symrig::board_linux {

/// Finds the lines on whatever chips have them, by name, and takes them: outputs at `levels` from the first
/// moment on, inputs with their edges.
/// fails: unknown_name (no such line, or a name that several lines have), device_refused (a line is in use,
/// and by whom; no right to a chip, and which group has it), io.
Result<std::unique_ptr<KernelGpio>> take_lines(const std::vector<BoardLine>& lines, std::uint32_t levels);

}  // namespace symrig::board_linux
