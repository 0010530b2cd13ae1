// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gpio.hpp"
#include "line_request.hpp"

#include <memory>
#include <vector>

namespace symrig::board_linux {

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
