// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <memory>
#include <string>

namespace symrig::apps {

/// True for "sim:…".
bool is_simulated(const std::string& rig);

/// Opens `--rig RIG`. Only `sim:NAME?key=value&…` so far; a rig described in a file is refused in plain
/// words. fails: unknown_name, bad_argument, bad_format, device errors.
Result<std::unique_ptr<sim::VirtualRig>> open_rig(const std::string& rig);

/// The scene of a `sim:` rig alone, for ground truth: no board, camera or noise.  fails: as open_rig.
Result<std::shared_ptr<const sim::Scene>> open_truth(const std::string& rig);

/// The scene as the function that evaluate() and reports take; keeps the scene alive. Each use is one step of
/// `progress`, which may be empty.
TrueTransport truth_of(std::shared_ptr<const sim::Scene> scene, Progress progress = {});

/// "plane, vgroove-white, …", for help texts.
std::string known_scenes();

/// Help text on sim: rigs and their keys.
std::string rig_help();

}  // namespace symrig::apps
