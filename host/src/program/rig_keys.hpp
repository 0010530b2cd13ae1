// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/table_reader.hpp"
#include "symrig/program/program_file.hpp"

namespace symrig::program {

/// The [rig] part of a program file. node may be null: defaults.
void read_rig(const base::TomlNode* node, const std::filesystem::path& folder, base::ReadContext& context,
              RigSetup& rig);

}  // namespace symrig::program
