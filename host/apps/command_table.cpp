// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "meter.hpp"
#include "program.hpp"

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

std::vector<std::string_view> command_names(std::span<const Command> of) {
  std::vector<std::string_view> names;
  names.reserve(of.size());
  for (const Command& command : of) names.push_back(command.name);
  return names;
}

const Program& symrig_program() {
  static const Program program{"symrig",
                               "measures how a real scene transports light, and relights it",
                               "symrig measures how a real scene transports light, and lets you relight it.",
                               kExample,
                               kCommands,
                               catch_interrupts,
                               true};
  return program;
}

}  // namespace symrig::apps
