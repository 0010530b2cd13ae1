// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "options.hpp"
#include "output.hpp"
#include "symrig/base/text.hpp"

#include <memory>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

std::string help_text(const CLI::App& app, const std::string& call) {
  // CLI::App::help() of the program would delegate to the command that was parsed, which is `help`.
  return app.get_formatter()->make_help(&app, call, CLI::AppFormatMode::Normal);
}

/// The help of the whole program, or of one command: as `symrig --help` and `symrig COMMAND --help` print it.
Result<void> run(const CLI::App& symrig, const std::string& name) {
  if (name.empty()) return print(help_text(symrig, "symrig"));
  const auto named =
      symrig.get_subcommands([&name](const CLI::App* command) { return command->get_name() == name; });
  if (named.empty())
    return Error{ErrorCode::unknown_name, fmt::format("there is no command '{}'", name),
                 nearest_hint(name, command_names())};
  return print(help_text(*named.front(), "symrig " + name));
}

}  // namespace

Job add_help(CLI::App& command) {
  const auto name = std::make_shared<std::string>();
  takes_words(command.add_option("command", *name, "The command; without it, the help of symrig")
                  ->type_name("COMMAND"),
              command_names());
  command.footer(std::string("Example:\n"
                             "  symrig help capture\n"
                             "\n") +
                 kExitCodes);
  return [&command, name] { return run(*command.get_parent(), *name); };
}

}  // namespace symrig::apps
