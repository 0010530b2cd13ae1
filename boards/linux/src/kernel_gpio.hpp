// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board_file.hpp"
#include "gpio.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace symrig::board_linux {

/// A line of a chip, and its number on the board.
struct ChipLine {
  std::uint32_t offset = 0;
  std::uint8_t line = 0;
  Bias bias = Bias::as_is;  ///< of an input
};

/// Lines of one chip, requested together (GPIO character device, version 2: linux/gpio.h). Version 2 numbers
/// the edges, so a lost one is noticed. Version 1, which libgpiod 1.6 uses, buffers 16 edges per line and
/// silently drops others.
struct LineRequest {
  Fd fd;
  std::vector<ChipLine> lines;  ///< in the order of the request's bits
  std::uint32_t mask = 0;       ///< board word mask of these lines
  std::uint32_t seqno = 0;      ///< of the last edge that was read
};

/// Outputs at `levels` (the board's word) from the first moment.
/// fails: io, with errno's text.
Result<LineRequest> request_outputs(int chip, const std::vector<ChipLine>& lines, std::uint32_t levels);
/// Inputs with their bias and both edges, stamped with CLOCK_MONOTONIC.
/// fails: io, with errno's text.
Result<LineRequest> request_inputs(int chip, const std::vector<ChipLine>& lines);

/// GPIO lines of this computer. They are released when the object is destroyed.
class KernelGpio final : public Gpio {
 public:
  KernelGpio(std::vector<LineRequest> outputs, std::vector<LineRequest> inputs);

  using Gpio::put;
  bool put(std::uint32_t levels, std::uint32_t lines) noexcept override;
  bool inputs(std::uint32_t& levels) const noexcept override;
  std::span<const int> edge_fds() const override { return edge_fds_; }
  std::size_t read_edges(std::span<hal::CapturedEdge> out, bool& lost) override;

 private:
  std::vector<LineRequest> outputs_;
  std::vector<LineRequest> inputs_;
  std::vector<int> edge_fds_;
};

}  // namespace symrig::board_linux
