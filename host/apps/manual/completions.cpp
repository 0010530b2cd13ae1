// SPDX-License-Identifier: Apache-2.0

#include "manual/completions.hpp"

#include "command.hpp"
#include "manual/argument.hpp"

#include <functional>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::apps {

namespace {

constexpr const char* kBashHead =
    R"bash(# Completion of symrig for bash, made by the build from the command's own tables.

_symrig_words() {
  COMPREPLY+=($(compgen -W "$1" -- "$cur"))
  # What ends with a colon goes on.
  [[ ${#COMPREPLY[@]} != 1 || $COMPREPLY != *: ]] || compopt -o nospace
}

# A list with commas: the word after the last comma.
_symrig_list() {
  local before=${cur%"${cur##*,}"}
  COMPREPLY+=($(compgen -P "$before" -W "$1" -- "${cur##*,}"))
  compopt -o nospace
}

)bash";

constexpr const char* kBashTail =
    R"bash(# The number of positional arguments before the word at the cursor.
_symrig_places() {
  local k count=0
  for ((k = 2; k < cword; ++k)); do
    if _symrig_takes_value "$command ${words[k]}"; then
      k=$((k + 1))
    elif [[ ${words[k]} != -* ]]; then
      count=$((count + 1))
    fi
  done
  echo "$count"
}

_symrig() {
  local cur prev words cword split=false
  _init_completion -s -n : || return
  local command=${words[1]}
  if ((cword == 1)); then
    _symrig_words "$(_symrig_options '')"
  elif _symrig_takes_value "$command $prev"; then
    _symrig_value "$command $prev"
  elif $split; then
    return
  elif [[ $cur == -* ]]; then
    _symrig_words "$(_symrig_options "$command")"
  else
    _symrig_value "$command $(_symrig_places)"
  fi
  __ltrim_colon_completions "$cur"
}

complete -F _symrig symrig
)bash";

/// Calls `see` for each argument of each command.
void for_each_argument(const CLI::App& app,
                       const std::function<void(const std::string& command, const Argument&)>& see) {
  for (const Command& command : commands())
    for (const Argument& argument : arguments_of(*app.get_subcommand(std::string(command.name))))
      see(std::string(command.name), argument);
}

/// "'capture -o' | 'capture --output'".
std::string pattern_of(const std::string& command, const Argument& argument) {
  std::vector<std::string> patterns;
  for (const std::string& name : argument.names) patterns.push_back(fmt::format("'{} {}'", command, name));
  return fmt::format("{}", fmt::join(patterns, " | "));
}

std::string options_function(const CLI::App& app) {
  std::vector<std::string> first;
  for (const std::string_view name : command_names()) first.emplace_back(name);
  for (const Argument& argument : arguments_of(app))
    first.insert(first.end(), argument.names.begin(), argument.names.end());
  std::string text =
      fmt::format("_symrig_options() {{\n  case $1 in\n    '') echo '{}' ;;\n", fmt::join(first, " "));
  for (const Command& command : commands()) {
    std::vector<std::string> names;
    for (const Argument& argument : arguments_of(*app.get_subcommand(std::string(command.name))))
      names.insert(names.end(), argument.names.begin(), argument.names.end());
    text += fmt::format("    {}) echo '{}' ;;\n", command.name, fmt::join(names, " "));
  }
  return text + "  esac\n}\n\n";
}

std::string takes_value_function(const CLI::App& app) {
  std::string text = "_symrig_takes_value() {\n  case $1 in\n";
  for_each_argument(app, [&text](const std::string& command, const Argument& argument) {
    if (!argument.positional() && argument.value != Value::none)
      text += fmt::format("    {}) return 0 ;;\n", pattern_of(command, argument));
  });
  return text + "  esac\n  return 1\n}\n\n";
}

/// The shell commands that fill COMPREPLY.
std::string offers(const Argument& argument) {
  std::string text;
  if (!argument.words.empty())
    text += fmt::format(" {} '{}';", argument.list ? "_symrig_list" : "_symrig_words",
                        fmt::join(argument.words, " "));
  if (argument.value == Value::folder) text += " _filedir -d;";
  if (argument.value == Value::file && argument.suffixes.empty()) text += " _filedir;";
  if (argument.value == Value::file && !argument.suffixes.empty())
    text += fmt::format(" _filedir '@({})';", fmt::join(argument.suffixes, "|"));
  return text.empty() ? " :;" : text;
}

/// Positional arguments are numbered. Where there is none, options are offered.
std::string value_function(const CLI::App& app) {
  std::string text = "_symrig_value() {\n  case $1 in\n", before;
  int place = 0;
  for_each_argument(app, [&](const std::string& command, const Argument& argument) {
    if (command != std::exchange(before, command)) place = 0;
    if (argument.positional())
      text += fmt::format("    '{} {}'){};\n", command, place++, offers(argument));
    else if (argument.value != Value::none)
      text += fmt::format("    {}){};\n", pattern_of(command, argument), offers(argument));
  });
  return text + "    *) _symrig_words \"$(_symrig_options \"$command\")\" ;;\n  esac\n}\n\n";
}

}  // namespace

std::string bash_completion(const CLI::App& app) {
  return kBashHead + options_function(app) + takes_value_function(app) + value_function(app) + kBashTail;
}

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
