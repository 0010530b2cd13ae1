// SPDX-License-Identifier: Apache-2.0
#include "scene_for_c.h"

#include "symrig/acquisition/capture.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/tensor/file.hpp"

#include <algorithm>

int make_scene(const char* path, const float* pattern, float* photograph) {
  auto rig = symrig::open_virtual_rig("sim:vgroove-textured?size=9x11&noise=off");
  if (!rig) return 1;
  auto captured = symrig::capture(**rig, {});
  if (!captured) return 2;
  symrig::StoredScene scene;
  scene.tensor = captured->tensor;
  if (!symrig::save_scene(path, scene)) return 3;
  const auto stored = symrig::load_scene(path);
  if (!stored) return 4;
  symrig::Image<float> light(stored->tensor.projector_grid());
  std::copy_n(pattern, light.values().size(), light.values().begin());
  const auto relit = stored->tensor.apply(light);
  if (!relit) return 5;
  std::copy(relit->values().begin(), relit->values().end(), photograph);
  return 0;
}
