// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/projector/projector.hpp"

#include <functional>
#include <memory>

namespace symrig {

/// How the three devices of a rig are opened, at first and again when one was lost. Each may be called any
/// number of times; what it gave before is gone by then. At first in the
/// order board, camera, projector.
struct RigDevices {
  std::function<Result<Board>()> board;
  std::function<Result<std::unique_ptr<Projector>>()> projector;
  std::function<Result<std::unique_ptr<Camera>>()> camera;
};

}  // namespace symrig
