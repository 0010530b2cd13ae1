// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "findings.hpp"

namespace symrig::device {

/// A scan against what its camera, its projector and its lamp can do.
void check_scan(const RigSetup& rig, const Scan& scan, const BoardInfo& board, Findings& findings);

}  // namespace symrig::device
