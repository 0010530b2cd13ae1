// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/dense/mat_variable.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::sim {

/// All variables of a MAT file of level 5. Compressed ones are uncompressed as far as their heads reach.
/// fails: bad_format.
Result<std::vector<MatVariable>> level5_variables(std::string_view bytes, const std::string& file);
bool is_level5(std::string_view bytes);

/// The uncompressed element of a variable.  fails: bad_format (damaged; longer or shorter than it states).
Result<std::vector<std::byte>> uncompressed(const MatVariable& variable, const std::string& file);

}  // namespace symrig::sim
