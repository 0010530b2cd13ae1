// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/sim_board.hpp"
#include "symrig/boards/sim_peripherals.hpp"
#include "symrig/device/board.hpp"
#include "symrig/device/bracket.hpp"
#include "symrig/device/frame_ledger.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace symrig::device {
namespace {

using namespace std::chrono_literals;

TEST(Capture, eight_hundred_photographs_of_four_exposures) {
  boards::SimBoard sim;
  boards::SimProjector projector(sim);
  boards::SimCamera camera(sim);
  sim.attach(projector);
  sim.attach(camera);
  auto board = Board::connect(make_sim_link(sim));
  ASSERT_TRUE(board.ok()) << board.error().line();
  const std::vector<LineConfig> lines{{.line = "camera_strobe", .capture = true}};
  const auto configured = board->configure(lines);
  ASSERT_TRUE(configured.ok()) << configured.error().line();

  const std::vector<Nanoseconds> exposures{100us, 800us, 6400us, 51200us};
  const auto program = compile_bracket(board->info(), {}, exposures, 800);
  ASSERT_TRUE(program.ok()) << program.error().line();
  const auto receipt = board->run(*program, 3600s);
  ASSERT_TRUE(receipt.ok()) << receipt.error().line();
  EXPECT_TRUE(receipt->clean());
  EXPECT_EQ(receipt->marks.size(), 800U * 5U);
  EXPECT_EQ(camera.frames().size(), 3200U);
  EXPECT_EQ(camera.missed_triggers(), 0);
  EXPECT_EQ(projector.changes().size(), 800U);
}

}  // namespace
}  // namespace symrig::device
