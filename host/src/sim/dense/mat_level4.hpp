// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/dense/mat_variable.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace symrig::sim {

/// All variables of a MAT file of level 4.  fails: bad_format.
Result<std::vector<MatVariable>> level4_variables(std::string_view bytes, const std::string& file);
bool is_level4(std::string_view bytes);

}  // namespace symrig::sim
