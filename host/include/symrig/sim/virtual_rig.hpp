// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/sim/scene.hpp"

#include <memory>
#include <string_view>

namespace symrig::sim {

/// A whole rig in virtual time: the real firmware core on boards/sim, spoken to in bytes; a 60 Hz projector
/// and a triggered camera on its lines; a scene in front of them; frames merged by hdr. Answers patterns as a
/// Probe.
class VirtualRig : public Probe {
 public:
  /// The scene itself, to measure errors against (`symrig evaluate`).
  virtual const Scene& truth() const = 0;
  virtual const SceneUri& uri() const = 0;
};

/// fails: as parse_scene_uri and make_scene; device errors if the board refuses the configuration.
Result<std::unique_ptr<VirtualRig>> open_virtual_rig(std::string_view uri);

}  // namespace symrig::sim
