// SPDX-License-Identifier: Apache-2.0
#include "manual/argument.hpp"
#include "manual/pages.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>
#include <cctype>
#include <cstddef>
#include <map>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

constexpr std::string_view kHeading = "## ";
constexpr std::string_view kTable = "@commands@";

/// A cell of a table: one line, in which a bar ends no cell.
std::string cell(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' ? ' ' : c;
  }
  return out;
}

std::string code(std::string_view text) {
  return "`" + cell(text) + "`";
}

/// "relight, dual" of "## relight and dual"; none if a word of the heading is no command.
std::vector<std::string> commands_of(std::string_view line, const Program& program) {
  std::vector<std::string> names;
  std::string words(line.substr(kHeading.size()));
  std::replace(words.begin(), words.end(), ',', ' ');
  std::istringstream each(words);
  for (std::string word; each >> word;) {
    if (word == "and") continue;
    if (std::ranges::find(program.commands, word, &Command::name) == program.commands.end()) return {};
    names.push_back(word);
  }
  return names;
}

/// How GitHub names the place of a heading.
std::string place_of(std::string_view heading) {
  std::string place;
  for (const unsigned char c : heading) {
    if (c == ' ') place += '-';
    if (std::isalnum(c) != 0 || c == '-') place += static_cast<char>(std::tolower(c));
  }
  return place;
}

std::string argument_row(const Argument& argument) {
  std::string names;
  for (const std::string& name : argument.names) {
    const bool last = &name == &argument.names.back();
    const std::string type = last && !argument.type.empty() ? " " + argument.type : "";
    names += (names.empty() ? "" : ", ") + code(name + type);
  }
  if (argument.positional()) names = code(argument.type);
  std::string about = cell(argument.about);
  if (argument.required) about += ". Required";
  if (!argument.standard.empty()) about += ". Default: " + code(argument.standard);
  return fmt::format("| {} | {} |\n", names, about);
}

/// What a command does, and its options, as in its help.
std::string command_part(const CLI::App& command, bool named) {
  std::string text = named ? "**" + command.get_name() + "**: " : "";
  text += command.get_description() + ".\n\n| option | is |\n|---|---|\n";
  for (const Argument& argument : arguments_of(command))
    if (std::find(argument.names.begin(), argument.names.end(), "--help") == argument.names.end())
      text += argument_row(argument);
  return text;
}

std::string command_table(const Program& program, const std::map<std::string, std::string>& places) {
  std::string text = "| command | does |\n|---|---|\n";
  for (const Command& command : program.commands) {
    const std::string name(command.name);
    text += fmt::format("| [{}](#{}) | {} |\n", code(name), places.at(name), cell(command.about));
  }
  return text;
}

}  // namespace

Result<std::string> command_line_page(const Program& program, const CLI::App& app, const std::string& texts) {
  std::map<std::string, std::string> places;
  std::string body;
  std::istringstream lines(texts);
  for (std::string line; std::getline(lines, line);) {
    body += line + "\n";
    if (!line.starts_with(kHeading)) continue;
    const std::vector<std::string> names = commands_of(line, program);
    for (const std::string& name : names) {
      places[name] = place_of(line.substr(kHeading.size()));
      body += "\n" + command_part(*app.get_subcommand(name), names.size() > 1);
    }
  }
  for (const Command& command : program.commands)
    if (!places.contains(std::string(command.name)))
      return Error{ErrorCode::bad_value, fmt::format("no section on {}", command.name),
                   "add a heading to command-line.md.in"};
  const std::size_t at = body.find(kTable);
  if (at == std::string::npos)
    return Error{ErrorCode::bad_value, fmt::format("no line {}", kTable), "it becomes the table of commands"};
  std::string table = command_table(program, places);
  table.pop_back();  // the line of the mark goes on
  return body.replace(at, kTable.size(), table);
}

Result<void> write_command_line(const std::filesystem::path& texts, const std::filesystem::path& file,
                                const Program& program, const CLI::App& app) {
  SYMRIG_TRY(const std::vector<std::byte> bytes, read_file(texts));
  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-reinterpret-cast): text of a file
  const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  SYMRIG_TRY(const std::string page, command_line_page(program, app, text));
  return write_file_atomically(file, page);
}

}  // namespace symrig::apps
