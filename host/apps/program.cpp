// SPDX-License-Identifier: Apache-2.0

#include "program.hpp"

#include "command.hpp"
#include "meter.hpp"
#include "output.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <cctype>
#include <csignal>
#include <exception>
#include <new>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <malloc.h>

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

namespace {

/// The option's name: "--rig" of "--rig=x", "-o" of "-oscene.h5"; empty if the word is not an option. A
/// number below 0 is a value.
std::string option_in(const std::string& word) {
  if (word.size() < 2 || word[0] != '-' || word == "--") return {};
  if (word[1] == '-') return word.substr(0, word.find('='));
  const bool number = (word[1] >= '0' && word[1] <= '9') || word[1] == '.';
  return number ? std::string() : word.substr(0, 2);
}

/// The number of following words that are values of the option, whatever they look like.
std::size_t values_after(const CLI::Option& option, const std::string& word, const std::string& name) {
  const bool joined = word.size() > name.size();
  const int least = std::max(0, option.get_items_expected_min());
  return joined ? 0 : static_cast<std::size_t>(least);
}

/// Long names without their dashes.
std::vector<std::string> option_names(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back(name);
  return names;
}

std::string no_option(const CLI::App& command, const std::string& name) {
  const std::vector<std::string> names = option_names(command);
  const std::vector<std::string_view> known(names.begin(), names.end());
  const std::size_t dashes = std::min<std::size_t>(name.find_first_not_of('-'), name.size());
  const auto nearest = nearest_name(std::string_view(name).substr(dashes), known);
  const std::string meant = nearest ? fmt::format("; did you mean '--{}'?", *nearest) : std::string();
  return fmt::format("there is no option '{}'{}", name, meant);
}

/// "there is no command 'captur'; did you mean 'capture'? commands: capture, relight".
std::string no_command(std::string_view word, std::span<const std::string_view> commands) {
  return fmt::format("there is no command '{}'; {}commands: {}", word, suggestion(word, commands),
                     listed(commands));
}

/// The first word that looks like an option but is unknown, with the nearest known one: "there is no option
/// '--rgi'; did you mean '--rig'?". Nothing if all are known. The parser alone would first report a missing
/// required option.
/// words: what follows the command.
std::optional<std::string> unknown_option(const CLI::App& command, std::span<const std::string> words) {
  for (std::size_t k = 0; k < words.size() && words[k] != "--"; ++k) {
    const std::string name = option_in(words[k]);
    if (name.empty()) continue;
    const CLI::Option* option = command.get_option_no_throw(name);
    if (option == nullptr) return no_option(command, name);
    k += values_after(*option, words[k], name);
  }
  return std::nullopt;
}

/// "--json is empty": usually an unset variable of a script. Nothing if every option has a value.
std::optional<std::string> empty_value(const CLI::App& command) {
  for (const CLI::Option* option : command.get_options()) {
    if (option->count() == 0 || option->get_items_expected_min() == 0) continue;  // may go without a value
    const auto& values = option->results();
    if (std::any_of(values.begin(), values.end(), [](const std::string& value) { return value.empty(); }))
      return fmt::format("{} is empty; give a value, or remove the option", option->get_name());
  }
  return std::nullopt;
}

std::string& running_program() {
  static std::string name = "symrig";
  return name;
}

constexpr int kUsage = exit_code(ErrorCode::bad_argument);
constexpr int kFault = exit_code(ErrorCode::limit);

/// The first word, if it is neither a command nor an option.
std::optional<std::string> unknown_command(const Program& program, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return std::nullopt;
  for (const Command& command : program.commands)
    if (command.name == argv[1]) return std::nullopt;
  return argv[1];
}

int usage_error(std::string_view command, const std::string& line) {
  print_error(command, line);
  return kUsage;
}

int finish(std::string_view command, const Result<void>& result) {
  if (result) return 0;
  print_error(command, result.error().line());
  return exit_code(result.error().code);
}

/// Prints help or version. If that fails, the exit code reports it.
int print_help(CLI::App& app, const CLI::ParseError& error) {
  std::ostringstream text;
  app.exit(error, text, text);
  return finish("", print(text.str()));
}

/// What the program is for, how to begin, and its commands.
std::string overview(const Program& program) {
  return fmt::format("{}\n\n{}\nCommands: {}\n", program.description, program.footer,
                     listed(command_names(program.commands)));
}

/// Help and version end with code 0. Every other parser error is a usage error of one line.
int parse_failure(CLI::App& app, const CLI::ParseError& error, std::span<const std::string> words) {
  if (error.get_exit_code() == 0) return print_help(app, error);
  const auto named =
      app.get_subcommands([&](const CLI::App* one) { return one->get_name() == words.front(); });
  const CLI::App* const parsed = named.empty() ? nullptr : named.front();
  const std::string command = parsed == nullptr ? "" : parsed->get_name();
  const std::string separator = command.empty() ? "" : " ";
  const auto misspelt =
      parsed == nullptr ? unknown_option(app, words) : unknown_option(*parsed, words.subspan(1));
  const std::string what = misspelt ? *misspelt : std::string(error.what());
  return usage_error(command, fmt::format("{}; see {}{}{} --help", what, program_name(), separator, command));
}

int run(const Program& program, int argc, char** argv) {
  CLI::App app;
  const std::vector<Job> jobs = declare(app, program);
  if (const auto word = unknown_command(program, argc, argv))
    return usage_error("", no_command(*word, command_names(program.commands)));
  if (argc < 2) {
    write_standard_error(overview(program));
    return usage_error("", fmt::format("no command given; see {} --help", program.name));
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return parse_failure(app, error, std::vector<std::string>(argv + 1, argv + argc));
  }
  for (const CLI::App* command : app.get_subcommands())
    if (const auto empty = empty_value(*command)) return usage_error(command->get_name(), *empty);
  program.prepare();
  static_cast<void>(std::signal(
      SIGXFSZ, SIG_IGN));  // a file over its size limit then makes write() fail instead of ending the process
  for (std::size_t k = 0; k < jobs.size(); ++k)
    if (app.got_subcommand(std::string(program.commands[k].name)))
      return finish(program.commands[k].name, jobs[k]());
  return kUsage;
}

}  // namespace

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 2'000'000'000);
  mallopt(M_ARENA_MAX, 1);
}

const std::string& program_name() {
  return running_program();
}

std::vector<Job> declare(CLI::App& app, const Program& program) {
  app.name(program.name);
  app.description(program.description);
  app.require_subcommand(1);
  app.set_version_flag("-V,--version", program.name + " " SYMRIG_VERSION);
  app.footer(program.footer);
  std::vector<Job> jobs;
  jobs.reserve(program.commands.size());
  for (const Command& command : program.commands)
    jobs.push_back(command.add(*app.add_subcommand(std::string(command.name), command.about)));
  return jobs;
}

int run_program(const Program& program, int argc, char** argv) {
  running_program() = program.name;
  keep_freed_memory();
  remember_command_line(argc, argv);
  try {
    return run(program, argc, argv);
  } catch (const std::bad_alloc&) {
    write_standard_error(program_name().c_str());
    write_standard_error(": out of memory; use a smaller grid or a machine with more memory\n");
  } catch (const std::exception& error) {
    print_error("", std::string("internal fault: ") + error.what());
  }
  return kFault;
}

namespace {

std::string& remembered() {
  static std::string line;
  return line;
}

bool plain(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 ||
         std::string_view("_./:=,+-@%").find(c) != std::string_view::npos;
}

std::string quoted(std::string_view word) {
  std::string out(word);
  if (!word.empty() && std::all_of(word.begin(), word.end(), plain)) return out;
  out.assign(1, '\'');
  for (const char c : word) {
    if (c == '\'')
      out.append("'\\''");
    else
      out.push_back(static_cast<unsigned char>(c) < 0x20 || c == 0x7F ? '?' : c);
  }
  out.push_back('\'');
  return out;
}

}  // namespace

std::string shell_line(std::span<const char* const> words) {
  std::string line;
  for (const char* word : words) {
    if (!line.empty()) line.push_back(' ');
    line.append(quoted(word));
  }
  return line;
}

void remember_command_line(int argc, const char* const* argv) {
  std::vector<const char*> words{program_name().c_str()};
  if (argc > 1) words.insert(words.end(), argv + 1, argv + argc);
  remembered() = shell_line(words);
}

Made made_now() {
  return {utc_now(), SYMRIG_VERSION, remembered()};
}

}  // namespace symrig::apps
