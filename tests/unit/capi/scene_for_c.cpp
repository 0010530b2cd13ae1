// SPDX-License-Identifier: Apache-2.0
#include "scene_for_c.h"

#include "symrig/acquisition/capture.hpp"
#include "symrig/job/relight.hpp"
#include "symrig/sim/virtual_rig.hpp"
#include "symrig/tensor/file.hpp"
#include "unit/tensor/small_camera.hpp"

#include <algorithm>
#include <memory>
#include <utility>

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

int make_camera_scene(const char* path, const float* pattern, float* photograph, float* filters) {
  auto rig = symrig::open_virtual_rig("sim:vgroove-textured?size=9x11&noise=off&channels=3");
  if (!rig) return 1;
  auto captured = symrig::capture(**rig, {});
  if (!captured) return 1;
  symrig::StoredScene scene;
  scene.tensor = captured->tensor;
  auto camera = symrig::CameraTransport::make(symrig::test::small_mosaic(scene.tensor.projector_tree()));
  if (!camera) return 2;
  const symrig::CameraTransport::Parts& parts = camera->parts();
  std::size_t pixel = 0;
  for (const symrig::CameraTransport::Group& group : parts.groups)
    for (int k = 0; k < group.pixels; ++k) filters[15 * group.channel + parts.pixels[pixel++]] = 1;
  scene.camera = std::make_shared<const symrig::CameraTransport>(*std::move(camera));
  if (!symrig::save_scene(path, scene)) return 3;
  const auto relighter = symrig::Relighter::begin(scene.camera);
  if (!relighter) return 4;
  symrig::Image<float> light(scene.camera->projector_grid());
  std::copy_n(pattern, light.values().size(), light.values().begin());
  const auto relit = relighter->relight(light);
  if (!relit) return 5;
  std::copy(relit->values().begin(), relit->values().end(), photograph);
  return 0;
}
