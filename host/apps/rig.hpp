// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/job/rig_by_name.hpp"

#include <optional>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// The functions of symrig/job/rig_by_name.hpp. Ctrl-C ends their waiting.
Result<OpenedRig> open_bare_rig(const std::string& rig, std::optional<int> exposures = {});
Result<OpenedRig> open_rig_to_calibrate(const std::string& rig);
Result<OpenedRig> open_rig(const std::string& rig, const std::string& registration);

/// Adds `--registration FILE`.
void add_registration(CLI::App& command, std::string& registration);

/// The names of all scenes, for help texts: "plane, vgroove-white, …".
std::string known_scenes();

/// What went wrong during a capture and was repaired, one line for each; empty: nothing.
std::string trouble_text(const RigTrouble& trouble);

/// Help text: rigs, scenes and keys.
std::string rig_help();

}  // namespace symrig::apps
