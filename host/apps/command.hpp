// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// What a command does after its options are parsed. An Error becomes one line on standard error; its code
/// gives the exit code.
using Job = std::function<Result<void>()>;

/// add_capture() and so on, one function for each line of commands.def: declares the options and the end of
/// the help of this command, and returns its job.
#define SYMRIG_COMMAND_ROW(name, about) Job add_##name(CLI::App& command);
#include "commands.def"
#undef SYMRIG_COMMAND_ROW

/// The option `--json FILE`. "-" is standard output.
inline void add_json(CLI::App& command, std::string& file) {
  command.add_option("--json", file, "Also write the numbers as JSON; - is standard output")
      ->type_name("FILE");
}

/// Shown at the end of each command's help.
inline constexpr const char* kExitCodes =
    "Exit codes: 0 done, 2 usage, 3 device, 4 bad input, 5 fault or limit (5 also when stopped by Ctrl-C).";

/// A command of a program; those of `symrig` are the lines of commands.def.
struct Command {
  std::string_view name;
  const char* about;
  Job (*add)(CLI::App& command);
};

/// The commands of `symrig`.
std::span<const Command> commands();
std::vector<std::string_view> command_names(std::span<const Command> of = commands());

}  // namespace symrig::apps
