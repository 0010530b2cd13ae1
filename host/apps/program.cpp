// SPDX-License-Identifier: Apache-2.0
#include "program.hpp"

#include "console.hpp"
#include "invocation.hpp"
#include "meter.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/text.hpp"
#include "usage.hpp"

#include <csignal>
#include <exception>
#include <new>
#include <optional>
#include <sstream>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <malloc.h>

namespace symrig::apps {
namespace {

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

}  // namespace symrig::apps
