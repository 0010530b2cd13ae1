// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/alignment.hpp"

#include <string>

/// Names and numbers of the goals of an alignment.
namespace symrig::report {

/// "focus"; the key in JSON, too.
std::string name_of(AlignmentGoal goal);
/// "0.31 cells"
std::string value_text(const AlignmentFinding& finding);
/// "≤ 0.10"
std::string wanted_text(const AlignmentFinding& finding);

}  // namespace symrig::report
