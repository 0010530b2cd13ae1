// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/made.hpp"

#include <span>
#include <string>

namespace symrig::apps {

/// Quotes words as one line that a shell splits into the same words. Control characters become '?'.
std::string shell_line(std::span<const char* const> words);

/// Stores the command line. main calls this once. The first word becomes the name of the program, whatever
/// the path of the command.
void remember_command_line(int argc, const char* const* argv);

/// The present time, this version, and the stored command line.
Made made_now();

}  // namespace symrig::apps
