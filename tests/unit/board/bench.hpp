// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "assert_ok.hpp"
#include "servers.hpp"
#include "symrig/board/board.hpp"
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

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

/// A board with a projector and a camera on its lines.
struct Bench {
  board_sim::SimBoard sim;
  board_sim::SimProjector projector{sim};
  board_sim::SimCamera camera{sim};

  Bench() {
    sim.attach(projector);
    sim.attach(camera);
  }
  Board connect(const BoardOptions& options = {}) { return connect(make_sim_link(sim), options); }
  static Board connect(std::unique_ptr<Link> link, const BoardOptions& options = {}) {
    auto board = Board::connect(std::move(link), options);
    EXPECT_TRUE(board.ok()) << (board.ok() ? "" : board.error().line());
    return std::move(board).value();
  }
};

/// What a board with the default lines says of itself.
inline BoardInfo default_info() {
  BoardInfo info;
  info.board = "sim";
  info.rate = {125'000'000};
  info.lines = {{"projector_trigger", true},
                {"camera_trigger", true},
                {"lamp_enable", true},
                {"vsync", false},
                {"camera_strobe", false}};
  info.min_dwell = {5};
  info.max_dwell = {0xFFFFFFFF};
  info.wait_latency = {125};
  info.program_bytes = 196'608;
  info.loop_depth = 4;
  info.mtu = 512;
  info.window = 8;
  return info;
}

}  // namespace symrig::test
