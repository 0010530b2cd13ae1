// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/base/result.hpp"

namespace symrig::apps {

/// What settings_of() and check_rig() refuse, in the words of the command line: what they name max_patterns
/// is
/// --max-patterns there.
Error in_command_words(Error error);

/// The same for one list of tolerances.  fails: bad_argument (naming the option) unless 0 < value < 1.
Result<void> check_tolerance(const char* option, double value);

}  // namespace symrig::apps
