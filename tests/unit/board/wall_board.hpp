// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "socket_server.hpp"
#include "symrig/boards/sim_board.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <vector>

namespace symrig::test {

/// A simulated board on a descriptor, its clock driven by the wall's, until the other end closes.
inline void serve_board(int fd, const std::atomic<bool>& stop) {
  board_sim::SimBoard board;
  const auto begin = std::chrono::steady_clock::now();
  std::vector<std::uint8_t> bytes;
  while (!stop && read_some(fd, bytes)) {
    const auto passed = std::chrono::nanoseconds(std::chrono::steady_clock::now() - begin).count();
    board.advance_to(static_cast<std::uint64_t>(passed) / 8);
    board.write(bytes);
    write_all(fd, board.read());
  }
}

}  // namespace symrig::test
