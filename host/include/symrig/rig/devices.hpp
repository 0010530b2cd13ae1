// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/board/board.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/projector/projector.hpp"

#include <functional>
#include <memory>

namespace symrig {

/// Functions that open the three devices of a rig, at first and again after one was lost. Each may be called
/// many times; the previous object is destroyed before the call. The first order is board, camera, projector.
struct RigDevices {
  std::function<Result<Board>()> board;
  std::function<Result<std::unique_ptr<Projector>>()> projector;
  std::function<Result<std::unique_ptr<Camera>>()> camera;
};

}  // namespace symrig
