// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program/findings.hpp"

namespace symrig::program {

/// Checks a scan against the limits of its camera, its projector and its lamp.
void check_scan(const RigSetup& rig, const Scan& scan, const BoardInfo& board, Findings& findings);

}  // namespace symrig::program
