// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program.hpp"

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// The manual page PROGRAM(1): the commands, what holds for all of them, exit codes, environment.
std::string program_page(const Program& program, const CLI::App& app, const std::string& version);

/// The manual page PROGRAM-COMMAND(1): call, options, and the end of the help.
std::string command_page(const Program& program, const CLI::App& command, const std::string& version);

}  // namespace symrig::apps
