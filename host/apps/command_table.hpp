// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.hpp"

#include <span>
#include <string_view>
#include <vector>

namespace symrig::apps {

/// A line of commands.def.
struct Command {
  std::string_view name;
  const char* about;
  Job (*add)(CLI::App& command);
};
std::span<const Command> commands();
std::vector<std::string_view> command_names();

/// Declares `symrig`, its commands and their options. Returns the jobs in the order of commands(). What is
/// declared here is all that help, manual pages and completions show.
std::vector<Job> declare(CLI::App& app);

}  // namespace symrig::apps
