// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board_file.hpp"
#include "kernel_gpio.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace symrig::board_linux {

/// Finds the lines by name on all chips, and requests them: outputs at `levels` from the first moment, inputs
/// with edge events.
/// fails: unknown_name (no such line, or several with that name), device_refused (a line is in use, with its
/// user; no permission for a chip, with its group), io.
Result<std::unique_ptr<KernelGpio>> take_lines(const std::vector<BoardLine>& lines, std::uint32_t levels);

}  // namespace symrig::board_linux
