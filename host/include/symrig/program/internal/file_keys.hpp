// SPDX-License-Identifier: Apache-2.0
// The parts of a program file, each read by a source of its own.
#pragma once

#include "symrig/base/internal/table_reader.hpp"
#include "symrig/program/profile.hpp"
#include "symrig/program/program_file.hpp"

namespace symrig::program {

/// The [rig] part of a program file. node may be null: defaults.
void read_rig(const base::TomlNode* node, const std::filesystem::path& folder, base::ReadContext& context,
              RigSetup& rig);

// The keys of a profile: in its own file, or in a program's rig to override it. A key that is set there is no
// longer an assumption.
void read_camera_keys(base::TableReader& table, CameraProfile& camera);
void read_projector_keys(base::TableReader& table, ProjectorProfile& projector);

/// The [program] part of a program file, if it is a scan.
void read_scan(base::TableReader& table, Scan& scan);

/// Reads the list of steps of a program with steps.
std::vector<FileStep> read_steps(const base::TomlNode& list, const std::string& path,
                                 base::ReadContext& context);

}  // namespace symrig::program
