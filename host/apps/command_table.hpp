// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.hpp"

#include <span>
#include <string_view>
#include <vector>

namespace symrig::apps {

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
