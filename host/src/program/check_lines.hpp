// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/findings.hpp"

namespace symrig::program {

/// Reports unknown lines, missing roles, wrong directions, and lamps without a keep-alive.
void check_lines(const ProgramFile& file, const BoardInfo& board, Findings& findings);

/// Reports numbers of the device profiles that have no source.
void check_profiles(const ProgramFile& file, Findings& findings);

}  // namespace symrig::program
