// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/rig/pair_link.hpp"
#include "symrig/rig/rig.hpp"
#include "symrig/sim/scene.hpp"

#include <cstddef>
#include <functional>
#include <memory>
#include <string_view>
#include <vector>

namespace symrig {

/// Several projector-camera pairs in virtual time, in front of one scene whose views they share. The real
/// firmware core fires them together. Each pair has a camera of its own with its own ledger. The photographs
/// are those of the single rig open_virtual_rig(), to the last bit.
class SimulatedPairs : public Probe {
 public:
  virtual const SceneUri& uri() const = 0;
  /// The rig inside, for its trouble().
  virtual const Rig& rig() const = 0;
};

/// Functions between the simulated pairs and their rig.
struct SimulatedPairHooks {
  std::function<void(RigOptions& options)> options;
  /// The camera of a pair, each time it is opened. To test with misbehaving devices.
  std::function<std::unique_ptr<Camera>(std::size_t pair, std::unique_ptr<Camera> camera)> camera;
  /// The projectors of all pairs, from the simulated one with all their cells.
  std::function<Result<std::unique_ptr<Projector>>(Projector& all)> projector;
};

/// All pairs in this process.
/// fails: as parse_scene_uri and make_scene; bad_argument (the scene's views cannot be dealt to such pairs,
/// or the scene's camera has pixels of its own, or its profile shows bit planes).
Result<std::unique_ptr<SimulatedPairs>> open_simulated_pairs(std::string_view uri, ViewLayout pairs,
                                                             SimulatedPairHooks hooks = {});

/// Where a pair is, and the connection to it.
struct LinkedPair {
  PairAddress address;
  std::unique_ptr<PairLink> link;
};
/// Each pair in a process of its own, made by make_simulated_pair(). This process has the board and the
/// trigger. A pair gets the pattern of all pairs, since their light reaches its camera, and answers its own
/// frames. A lost pair is connected again.
/// fails: also bad_argument (a pair simulates another scene, or has another place in the layout).
Result<std::unique_ptr<SimulatedPairs>> open_simulated_pairs(std::vector<LinkedPair> pairs, ViewLayout layout,
                                                             const PairLink::KeepWaiting& keep_waiting,
                                                             SimulatedPairHooks hooks = {});

/// One pair of open_simulated_pairs(), to be served. pair: its place in the layout, from 0.
/// fails: as open_simulated_pairs; bad_argument (no such pair).
Result<std::unique_ptr<PairService>> make_simulated_pair(std::string_view uri, ViewLayout pairs,
                                                         std::size_t pair);

}  // namespace symrig
