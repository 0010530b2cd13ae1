// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/board/link.hpp"
#include "symrig/image/outline.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/rig/frame_taker.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/sim/scene.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

namespace symrig {

/// A board in virtual time with a projector and a camera. wiring gives their lines and polarity, the
/// projector's refresh and the camera's readout. The link owns all of it.
std::unique_ptr<Link> make_sim_rig(const RigWiring& wiring);

}  // namespace symrig

namespace symrig::board_sim {

class SimBoard;
class SimCamera;
class SimPlaneProjector;

}  // namespace symrig::board_sim

namespace symrig {

/// A complete rig in virtual time. The real firmware core runs on boards/sim and talks in bytes to the host.
/// On its lines are a 60 Hz projector and a triggered camera in front of a scene. hdr merges the frames.
/// Measures patterns as a Probe.
class VirtualRig : public Probe {
 public:
  /// The scene, to compute errors (`symrig evaluate`).
  virtual const Scene& truth() const = 0;
  virtual const SceneUri& uri() const = 0;
  /// Where the corners of the camera's pixels look, exactly, when the rig starts: one map for each channel if
  /// they differ. Empty: the camera shares the projector's cells. For tests: a rig on a bench has no such
  /// thing.
  virtual std::vector<CornerMap> exact_corners() const = 0;
  /// What the camera sees of a pattern without noise, black level and faults, on its own grid, before it
  /// moves.
  virtual Image<float> ideal_photograph(const Image<float>& pattern) const = 0;
  /// The rig inside, for its trouble().
  virtual const Rig& rig() const = 0;
};

/// Functions between a virtual rig and its devices, to test a rig with misbehaving devices. The rig calls an
/// opener again when it opens a device again. The devices live as long as the virtual rig.
struct VirtualRigHooks {
  std::function<Result<std::unique_ptr<Camera>>(Camera& camera)> camera;
  std::function<Result<std::unique_ptr<Projector>>(Projector& projector)> projector;
  std::function<Result<Board>(board_sim::SimBoard& board)> board;
  std::function<void(RigOptions& options)> options;
  /// Called once with the projector of a profile with bit planes, to give it faults.
  std::function<void(board_sim::SimPlaneProjector& projector, board_sim::SimBoard& board)> planes;
  /// Called once with the camera's shutter, to give it another trigger.
  std::function<void(board_sim::SimCamera& shutter)> shutter;
  /// host: the projector is a screen, and the rig shows each pattern itself.
  Pacing pacing = Pacing::trigger;
};

/// fails: as parse_scene_uri and make_scene; device errors if the board refuses the configuration.
Result<std::unique_ptr<VirtualRig>> open_virtual_rig(std::string_view uri);
Result<std::unique_ptr<VirtualRig>> open_virtual_rig(std::string_view uri, VirtualRigHooks hooks);

/// The devices of a virtual rig, for a FrameTaker.
/// fails: as parse_scene_uri and make_scene.
Result<RigParts> virtual_rig_parts(std::string_view uri, VirtualRigHooks hooks = {});

/// T of a simulated bench with a camera of its own, through the exact map: what a perfect registration
/// would capture, with its ghost, the gain ratio and the blurs of its optics corrected. It differs from T of
/// the ideal coaxial rig by what the camera's pixels do not show of a cell. Empty: the camera shares the
/// cells.
/// fails: as make_scene.
Result<std::optional<TrueTransport>> bench_truth(const SceneUri& uri);

/// T of a simulated bench on its camera's own pixels.
struct CameraTruth {
  TrueTransport photograph;        ///< also of signed patterns; a ghost is in it
  std::vector<CornerMap> corners;  ///< one map, or one for each channel
};
/// None: the camera shares the cells.  fails: as make_scene.
Result<std::optional<CameraTruth>> camera_truth(const SceneUri& uri);

/// The gain ratio of such a bench on the cells, exactly: GainRatio. Empty: the camera shares the cells.
/// fails: as make_scene.
Result<Image<float>> bench_gain(const SceneUri& uri);

}  // namespace symrig
