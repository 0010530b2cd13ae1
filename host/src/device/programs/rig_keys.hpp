// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/program_file.hpp"
#include "table_reader.hpp"

namespace symrig::device {

/// The [rig] part of a program file. node may be null: defaults.
void read_rig(const TomlNode* node, const std::filesystem::path& folder, ReadContext& context, RigSetup& rig);

}  // namespace symrig::device
