// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/link.hpp"
#include "symrig/program/program_file.hpp"

#include <memory>

namespace symrig {

/// A board in virtual time with a projector and a camera. wiring gives their lines and polarity, the
/// projector's refresh and the camera's readout. The link owns all of it.
std::unique_ptr<Link> make_sim_rig(const RigWiring& wiring);

/// The board's self-description, for compiling and linting without a board.
Result<BoardInfo> sim_board_info();

}  // namespace symrig
