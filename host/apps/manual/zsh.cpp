// SPDX-License-Identifier: Apache-2.0
#include "command_table.hpp"
#include "manual/argument.hpp"
#include "manual/completions.hpp"

#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::apps {
namespace {

constexpr const char* kZshHead =
    R"zsh(#compdef symrig
# Completion of symrig for zsh, made by the build from the command's own tables.

# _symrig_words WORD...: a word that ends with a colon goes on.
_symrig_words() {
  local -a open closed
  open=(${(M)@:#*:}) closed=(${@:#*:})
  compadd -a closed
  compadd -S '' -a open
}

# _symrig_words_or GLOB WORD...: also files.
_symrig_words_or() {
  local glob=$1
  shift
  _symrig_words "$@"
  _files -g "$glob"
}

)zsh";

/// For the text between single quotes. In a spec of _arguments, a colon ends a field and brackets the
/// explanation.
std::string quoted(std::string_view text, std::string_view escaped) {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += "'\\''";
    else if (escaped.find(c) != std::string_view::npos)
      out += std::string("\\") + c;
    else
      out += c;
  }
  return out;
}

std::string joined_words(const Argument& argument) {
  return quoted(fmt::format("{}", fmt::join(argument.words, " ")), ":");
}

/// "*.h5", "*.(toml|symprog)". With one suffix in parentheses, zsh would read it as a qualifier.
std::string suffix_glob(const std::vector<std::string>& suffixes) {
  if (suffixes.size() == 1) return "*." + suffixes.front();
  return fmt::format("*.({})", fmt::join(suffixes, "|"));
}

/// What _arguments does for a value.
std::string action(const Argument& argument) {
  if (argument.list) return fmt::format("_values -s , word {}", joined_words(argument));
  if (argument.value == Value::folder) return "_files -/";
  if (argument.value == Value::file && !argument.words.empty())
    return fmt::format(" _symrig_words_or \"*\" {}", joined_words(argument));
  if (argument.value == Value::file && !argument.suffixes.empty())
    return fmt::format("_files -g \"{}\"", suffix_glob(argument.suffixes));
  if (argument.value == Value::file) return "_files";
  return argument.words.empty() ? " " : fmt::format(" _symrig_words {}", joined_words(argument));
}

/// "'(-o --output)'{-o,--output=}'[about]:scene.h5:_files'" and so on.
std::string spec(const Argument& argument) {
  const std::string value = argument.value == Value::none
                                ? ""
                                : fmt::format(":{}:{}", quoted(argument.type, ":"), action(argument));
  if (argument.positional()) return fmt::format("'{}'", value);
  const std::string about = "[" + quoted(argument.about, "[]") + "]" + value;
  std::vector<std::string> names;
  for (const std::string& name : argument.names)
    names.push_back(name + (argument.value == Value::none ? "" : name.starts_with("--") ? "=" : "+"));
  if (names.size() == 1) return fmt::format("'{}{}'", names.front(), about);
  return fmt::format("'({})'{{{}}}'{}'", fmt::join(argument.names, " "), fmt::join(names, ","), about);
}

std::string call(const CLI::App& command) {
  std::string text = "_arguments -s";
  for (const Argument& argument : arguments_of(command)) text += " \\\n        " + spec(argument);
  return text;
}

}  // namespace

std::string zsh_completion(const CLI::App& app) {
  std::string text = std::string(kZshHead) + "_symrig_commands() {\n  local -a commands=(\n";
  for (const Command& command : commands())
    text += fmt::format("    '{}:{}'\n", command.name, quoted(command.about, ":"));
  text += "  )\n  _describe command commands\n}\n\n_symrig() {\n  local line state\n  _arguments -C";
  for (const Argument& argument : arguments_of(app)) text += " \\\n    " + spec(argument);
  text += " \\\n    '1: :_symrig_commands' \\\n    '*::argument:->argument'\n";
  text += "  [[ $state == argument ]] || return\n  case $line[1] in\n";
  for (const Command& command : commands())
    text += fmt::format("    {})\n      {}\n      ;;\n", command.name,
                        call(*app.get_subcommand(std::string(command.name))));
  return text + "  esac\n}\n\n_symrig \"$@\"\n";
}

}  // namespace symrig::apps
