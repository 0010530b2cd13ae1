// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/findings.hpp"

namespace symrig::program {

/// A scan against what its camera, its projector and its lamp can do.
void check_scan(const RigSetup& rig, const Scan& scan, const BoardInfo& board, Findings& findings);

}  // namespace symrig::program
