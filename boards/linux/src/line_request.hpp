// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/fd.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// A line of a chip and what the board calls it.
struct ChipLine {
  std::uint32_t offset = 0;
  std::uint8_t line = 0;
};

/// Lines of one chip that were asked of the kernel together (GPIO character device, version 2: linux/gpio.h).
/// Version 2 because it numbers edges, so that a lost one is known: version 1, which libgpiod 1.6 speaks,
/// keeps 16 edges a line and drops others without a word.
struct LineRequest {
  Fd fd;
  std::vector<ChipLine> lines;  ///< in the order of the request's bits
  std::uint32_t mask = 0;       ///< of those lines
  std::uint32_t seqno = 0;      ///< of the last edge read
};

/// Outputs at `levels` (the board's word) from the first moment on. fails: io, with errno's text.
Result<LineRequest> request_outputs(int chip, const std::vector<ChipLine>& lines, std::uint32_t levels);
/// Inputs with edges of both kinds, stamped by CLOCK_MONOTONIC. fails: io.
Result<LineRequest> request_inputs(int chip, const std::vector<ChipLine>& lines);

}  // namespace symrig::board_linux
