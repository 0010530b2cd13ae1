// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/frame.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace symrig::board_linux {

/// The answer to a host while another one uses the board: code 19 (busy) to its first request.
class BusyAnswer {
 public:
  /// Takes bytes from the host. Returns the answer when a request is complete, else nothing.
  std::vector<std::uint8_t> take(std::span<const std::uint8_t> bytes);

 private:
  protocol::FrameDecoder decoder_;
};

}  // namespace symrig::board_linux
