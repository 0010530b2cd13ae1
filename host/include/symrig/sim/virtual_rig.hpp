// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/sim/scene.hpp"

#include <functional>
#include <memory>
#include <string_view>

namespace symrig::board_sim {
class SimBoard;
}

namespace symrig {

/// A whole rig in virtual time: the real firmware core on boards/sim, spoken to in bytes; a 60 Hz projector
/// and a triggered camera on its lines; a scene in front of them; frames merged by hdr. Answers patterns as a
/// Probe.
class VirtualRig : public Probe {
 public:
  /// The scene itself, to measure errors against (`symrig evaluate`).
  virtual const Scene& truth() const = 0;
  virtual const SceneUri& uri() const = 0;
  /// The rig inside, for its trouble.
  virtual const Rig& rig() const = 0;
};

/// What stands between a virtual rig and its devices: for trying what a rig does when they misbehave. Each
/// opener is called again when the rig opens a device again; the devices live as long as the virtual rig.
struct VirtualRigHooks {
  std::function<Result<std::unique_ptr<Camera>>(Camera& camera)> camera;
  std::function<Result<std::unique_ptr<Projector>>(Projector& projector)> projector;
  std::function<Result<Board>(board_sim::SimBoard& board)> board;
  std::function<void(RigOptions& options)> options;
  /// host: the projector is a screen that the rig shows each pattern on by itself.
  Pacing pacing = Pacing::trigger;
};

/// fails: as parse_scene_uri and make_scene; device errors if the board refuses the configuration.
Result<std::unique_ptr<VirtualRig>> open_virtual_rig(std::string_view uri);
Result<std::unique_ptr<VirtualRig>> open_virtual_rig(std::string_view uri, VirtualRigHooks hooks);

}  // namespace symrig
