// SPDX-License-Identifier: Apache-2.0
#include "command_table.hpp"

#include <iterator>
#include <string>

namespace symrig::apps {
namespace {

constexpr Command kCommands[] = {
#define SYMRIG_COMMAND_ROW(name, about) {#name, about, add_##name},
#include "commands.def"
#undef SYMRIG_COMMAND_ROW
};

constexpr const char* kExample =
    "Example:\n"
    "  symrig capture --rig 'sim:vgroove-textured?size=64x64' -o scene.h5   measure how the scene "
    "transports light\n"
    "  symrig relight scene.h5 --light letters -o relit.png                 compute the picture "
    "under new light\n"
    "  symrig report scene.h5 -o report.html                                one page with pictures "
    "and numbers\n"
    "\n"
    "Exit codes: 0 done, 2 usage, 3 device, 4 bad input, 5 fault or limit.\n"
    "Each command has its own help: symrig help capture";

}  // namespace

std::span<const Command> commands() {
  return kCommands;
}

std::vector<std::string_view> command_names() {
  std::vector<std::string_view> names;
  names.reserve(std::size(kCommands));
  for (const Command& command : kCommands) names.push_back(command.name);
  return names;
}

std::vector<Job> declare(CLI::App& app) {
  app.name("symrig");
  app.description("symrig measures how a real scene transports light, and lets you relight it.");
  app.require_subcommand(1);
  app.set_version_flag("-V,--version", "symrig " SYMRIG_VERSION);
  app.footer(kExample);
  std::vector<Job> jobs;
  for (const Command& command : kCommands)
    jobs.push_back(command.add(*app.add_subcommand(std::string(command.name), command.about)));
  return jobs;
}

}  // namespace symrig::apps
