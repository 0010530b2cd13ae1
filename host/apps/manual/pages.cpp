// SPDX-License-Identifier: Apache-2.0
#include "manual/pages.hpp"

#include "manual/argument.hpp"
#include "manual/roff.hpp"

#include <algorithm>
#include <cctype>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

std::string upper(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

/// No date: the same source gives the same page on every day.
std::string head(const std::string& name, const std::string& version, const std::string& about) {
  return fmt::format(
      ".\\\" Made by the build from the command's own tables.\n.TH {} 1 \"\" \"symrig {}\" \"symrig\"\n"
      ".SH NAME\n{} \\- {}\n",
      upper(roff(name)), version, roff(name), roff(about));
}

/// "--algorithm NAME" with the name's type.
std::string call_of(const Argument& argument) {
  const std::string type = argument.type.empty() ? "" : " " + italic(argument.type);
  if (argument.positional()) return italic(argument.type);
  return bold(argument.names.front()) + type;
}

std::string synopsis(const std::string& call, const std::vector<Argument>& arguments) {
  std::string text = ".SH SYNOPSIS\n" + bold(call) + "\n";
  for (const Argument& argument : arguments)
    text += (argument.required ? call_of(argument) : "[" + call_of(argument) + "]") + "\n";
  return text;
}

std::string option_row(const Argument& argument) {
  std::string row = ".TP\n";
  for (const std::string& name : argument.names) row += (row.ends_with('\n') ? "" : ", ") + bold(name);
  if (!argument.type.empty()) row += (argument.positional() ? "" : " ") + italic(argument.type);
  row += "\n" + roff(argument.about) + ".\n";
  if (argument.required) row += "Required.\n";
  if (!argument.standard.empty()) row += "Default: " + roff(argument.standard) + ".\n";
  return row;
}

std::string option_rows(const std::vector<Argument>& arguments) {
  std::string text = ".SH OPTIONS\n";
  for (const Argument& argument : arguments) text += option_row(argument);
  return text;
}

std::string page_of(const Program& program, std::string_view command) {
  return bold(fmt::format("{}-{}", program.name, command));
}

constexpr const char* kBoardVariable =
    ".TP\n\\fBSYMRIG_DEVICE\\fR\nThe board of commands that have no \\fB\\-\\-device\\fR.\n";
constexpr const char* kColourVariable =
    ".TP\n\\fBNO_COLOR\\fR\nIf it is set and not empty, terminals get no colours.\n";

constexpr const char* kDocuments =
    "The documents are in /usr/share/doc/symrig if the Debian package is installed, and at\n"
    "https://github.com/symrig/symrig.\n";

}  // namespace

std::string program_page(const Program& program, const CLI::App& app, const std::string& version) {
  std::string text = head(program.name, version, program.about);
  text += ".SH SYNOPSIS\n" + bold(program.name) + " \\fICOMMAND\\fR [\\fIOPTIONS\\fR]\n.SH DESCRIPTION\n" +
          roff(app.get_description()) + "\nEach command has its own page.\n.SH COMMANDS\n";
  for (const Command& command : program.commands)
    text += fmt::format(".TP\n{}(1)\n{}.\n", page_of(program, command.name), roff(command.about));
  text += option_rows(arguments_of(app)) + ".SH ENVIRONMENT\n" + (program.boards ? kBoardVariable : "") +
          kColourVariable + footer_sections(app.get_footer());
  text += ".SH \"SEE ALSO\"\n";
  for (const Command& command : program.commands)
    text += fmt::format("{}(1),\n", page_of(program, command.name));
  return text + (program.boards ? "\\fBsymrigd\\fR(8)" : "\\fBsymrig\\fR(1)") + "\n.PP\n" + kDocuments;
}

std::string command_page(const Program& program, const CLI::App& command, const std::string& version) {
  const std::string& name = command.get_name();
  const std::vector<Argument> arguments = arguments_of(command);
  std::string about = command.get_description();
  about.front() = static_cast<char>(std::tolower(static_cast<unsigned char>(about.front())));
  return head(program.name + "-" + name, version, about) + synopsis(program.name + " " + name, arguments) +
         ".SH DESCRIPTION\n" + roff(command.get_description()) + ".\n" + option_rows(arguments) +
         footer_sections(command.get_footer()) + ".SH \"SEE ALSO\"\n" + bold(program.name) + "(1)\n.PP\n" +
         kDocuments;
}

}  // namespace symrig::apps
