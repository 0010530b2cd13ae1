// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/report/made.hpp"

#include <span>
#include <string>

namespace symrig::apps {

/// Words as one line that a shell takes apart into the same words. Control characters become '?'.
std::string shell_line(std::span<const char* const> words);

/// Called once, by main. The first word becomes "symrig", wherever the command lies.
void remember_command_line(int argc, const char* const* argv);

/// This moment, this version, the command line that was remembered.
Made made_now();

}  // namespace symrig::apps
