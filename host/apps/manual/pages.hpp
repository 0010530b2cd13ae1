// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "program.hpp"
#include "symrig/base/result.hpp"

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// The manual page PROGRAM(1): the commands, what holds for all of them, exit codes, environment.
std::string program_page(const Program& program, const CLI::App& app, const std::string& version);

/// The manual page PROGRAM-COMMAND(1): call, options, and the end of the help.
std::string command_page(const Program& program, const CLI::App& command, const std::string& version);

/// Writes FOLDER/man1/PROGRAM.1 and FOLDER/man1/PROGRAM-COMMAND.1. app: as declare() left it.
/// fails: io.
Result<void> write_pages(const std::filesystem::path& folder, const Program& program, const CLI::App& app);

/// docs/command-line.md. texts: what the help does not say, with a heading for each command and a line
/// @commands@. Each heading is followed by what its commands do, and by their options. fails: bad_value (a
/// command without a heading).
Result<std::string> command_line_page(const Program& program, const CLI::App& app, const std::string& texts);

/// The same from file to file.  fails: also as read_file; io.
Result<void> write_command_line(const std::filesystem::path& texts, const std::filesystem::path& file,
                                const Program& program, const CLI::App& app);

/// main() of a generator: write(argv[1]) makes the files. Returns the exit code.
int make_manual(int argc, char** argv, Result<void> (*write)(const std::filesystem::path& folder));

}  // namespace symrig::apps
