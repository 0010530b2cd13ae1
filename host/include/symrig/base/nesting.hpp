// SPDX-License-Identifier: Apache-2.0
// Limits how deep a text nests, before a parser reads it. Parsers, and trees that free themselves, call
// themselves once for each level: a file with 20,000 brackets would use up the stack.
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <string>
#include <string_view>

namespace symrig {

/// Files of symrig nest at most 8 levels deep.
constexpr std::size_t kDeepestNesting = 64;

/// fails: bad_format (arrays and objects more than kDeepestNesting deep). A text that is not JSON may pass.
Result<void> check_json_nesting(std::string_view text);

/// fails: bad_format ("FILE:LINE: ...": arrays, inline tables, or the parts of one dotted key, more than
/// kDeepestNesting deep). A text that is not TOML may pass.
Result<void> check_toml_nesting(std::string_view text, const std::string& file);

}  // namespace symrig
