// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/base/result.hpp"

namespace symrig::apps {

/// An error of settings_of() or check_rig() with the option names of the command line: max_patterns becomes
/// --max-patterns.
Error in_command_words(Error error);

/// An error of a CaptureJob whose next step names options: resume becomes --resume.
Error hint_in_command_words(Error error);

/// Checks one tolerance of a list.
/// fails: bad_argument (names the option) unless 0 < value < 1.
Result<void> check_tolerance(const char* option, double value);

}  // namespace symrig::apps
