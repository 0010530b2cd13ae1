// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// The manual page symrig(1): the commands, what holds for all of them, exit codes, environment.
std::string program_page(const CLI::App& app, const std::string& version);

/// The manual page symrig-COMMAND(1): call, options, and the end of the help.
std::string command_page(const CLI::App& command, const std::string& version);

}  // namespace symrig::apps
