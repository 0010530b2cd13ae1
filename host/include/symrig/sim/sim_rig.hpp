// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/link.hpp"
#include "symrig/program/program_file.hpp"

#include <memory>

namespace symrig {

/// A board in virtual time with a projector and a camera wired to it as said: on these lines, with
/// their polarity and the projector's refresh. The link owns all of it.
std::unique_ptr<Link> make_sim_rig(const RigWiring& wiring);

/// What such a board says of itself, to compile and lint against without one at hand.
Result<BoardInfo> sim_board_info();

}  // namespace symrig
