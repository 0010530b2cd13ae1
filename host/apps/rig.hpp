// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.hpp"
#include "symrig/base/result.hpp"
#include "symrig/job/rig_by_name.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// The functions of symrig/job/rig_by_name.hpp. Ctrl-C ends their waiting.
Result<OpenedRig> open_bare_rig(const std::string& rig, std::optional<int> exposures = {});
Result<OpenedRig> open_rig_to_calibrate(const std::string& rig);
/// max_seconds: of the capture; 0: no limit.
Result<OpenedRig> open_rig(const std::string& rig, const std::string& registration, double max_seconds = 0);

/// Adds `--registration FILE`.
void add_registration(CLI::App& command, std::string& registration);

/// The names of all scenes, for help texts: "plane, vgroove-white, …".
std::string known_scenes();

/// What went wrong during a capture and was repaired, one line for each; empty: nothing.
std::string trouble_text(const RigTrouble& trouble);

/// Help text: rigs, scenes and keys.
std::string rig_help();

/// A scene that a command works with.
struct OpenedScene {
  StoredScene scene;                                   ///< its tensor may be only a share of T
  std::shared_ptr<const TransportOperator> transport;  ///< all of T
};

/// Opens a scene file. `symrig` reads it into its process; `symrig-mpi` deals it over several.
using OpenScene = std::function<Result<OpenedScene>(const std::string& path, const LoadOptions& options)>;

/// fails: as load_scene.
Result<OpenedScene> open_here(const std::string& path, const LoadOptions& options);

/// The commands that only apply T, with scenes from `open`.
Job add_relight_of(CLI::App& command, OpenScene open);
Job add_evaluate_of(CLI::App& command, OpenScene open);

}  // namespace symrig::apps
