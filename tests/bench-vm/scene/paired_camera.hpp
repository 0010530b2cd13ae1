// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "bench-vm/scene/scene_camera.hpp"

#include <cstdint>
#include <memory>
#include <optional>

namespace symrig::bench_vm {

/// Two cameras that one trigger fires. Each gets its half of a frame's columns. `lost`: the number of a frame
/// that the right camera loses. The left one says what stamps mark.
std::unique_ptr<SceneCamera> pair_cameras(std::unique_ptr<SceneCamera> left,
                                          std::unique_ptr<SceneCamera> right, Grid each,
                                          std::optional<std::uint64_t> lost);

}  // namespace symrig::bench_vm
