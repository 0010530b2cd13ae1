// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"
#include "symrig/base/job_files.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <memory>
#include <string>

namespace symrig::apps {

/// True for "sim:…".
bool is_simulated(const std::string& rig);

/// A rig that `--rig` has opened.
struct OpenedRig {
  std::unique_ptr<Probe> probe;
  const Rig* rig = nullptr;  ///< inside the probe: for its trouble
  std::string noise;         ///< "off" or "camera"
};

/// What opening `--rig RIG` reads: the rig file and the files that it names.
JobFiles rig_files(const std::string& rig);

/// Opens `--rig RIG`: sim:NAME?key=value&… or a rig file (docs/rig-file.md).
/// fails: unknown_name, bad_argument, not_found, bad_format, device errors.
Result<OpenedRig> open_rig(const std::string& rig);

/// The same for simulated rigs only, which know their truth.
Result<std::unique_ptr<sim::VirtualRig>> open_simulated_rig(const std::string& rig);

/// The scene of a `sim:` rig alone, for ground truth: no board, camera or noise.  fails: as
/// open_simulated_rig.
Result<std::shared_ptr<const sim::Scene>> open_truth(const std::string& rig);

/// The scene as the function that evaluate() and reports take; keeps the scene alive. Each use is one step of
/// `progress`, which may be empty.
TrueTransport truth_of(std::shared_ptr<const sim::Scene> scene, Progress progress = {});

/// "plane, vgroove-white, …", for help texts.
std::string known_scenes();

/// What went wrong during a capture and was put right, a line each; empty: nothing.
std::string told(const RigTrouble& trouble);

/// Help text on sim: rigs and their keys.
std::string rig_help();

}  // namespace symrig::apps
