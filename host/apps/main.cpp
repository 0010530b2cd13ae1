// SPDX-License-Identifier: Apache-2.0
#include "command_table.hpp"
#include "console.hpp"
#include "invocation.hpp"
#include "meter.hpp"
#include "symrig/base/nearest_name.hpp"
#include "symrig/base/standard_streams.hpp"
#include "usage.hpp"

#include <csignal>
#include <exception>
#include <new>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <malloc.h>

namespace symrig::apps {
namespace {

constexpr int kUsage = exit_code(ErrorCode::bad_argument);
constexpr int kFault = exit_code(ErrorCode::limit);

/// The first word, if it is neither a command nor an option.
std::optional<std::string> unknown_command(int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return std::nullopt;
  for (const Command& command : commands())
    if (command.name == argv[1]) return std::nullopt;
  return argv[1];
}

/// Photographs are allocated and freed in batches. Returning their memory to the system each time takes
/// longer than merging them (docs/benchmarks.md).
void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, 2'000'000'000);
  mallopt(M_ARENA_MAX, 1);
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
  return usage_error(command, fmt::format("{}; see symrig{}{} --help", what, separator, command));
}

int run(int argc, char** argv) {
  CLI::App app;
  const std::vector<Job> jobs = declare(app);
  if (const auto word = unknown_command(argc, argv))
    return usage_error("", no_command(*word, command_names()));
  if (argc < 2)
    return usage_error(
        "", fmt::format("no command given; commands: {}; see symrig --help", listed(command_names())));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return parse_failure(app, error, std::vector<std::string>(argv + 1, argv + argc));
  }
  for (const CLI::App* command : app.get_subcommands())
    if (const auto empty = empty_value(*command)) return usage_error(command->get_name(), *empty);
  catch_interrupts();
  static_cast<void>(std::signal(
      SIGXFSZ, SIG_IGN));  // a file over its size limit then makes write() fail instead of ending the process
  for (std::size_t k = 0; k < jobs.size(); ++k)
    if (app.got_subcommand(std::string(commands()[k].name))) return finish(commands()[k].name, jobs[k]());
  return kUsage;
}

}  // namespace
}  // namespace symrig::apps

int main(int argc, char** argv) {
  symrig::reserve_standard_streams();
  symrig::apps::keep_freed_memory();
  symrig::apps::remember_command_line(argc, argv);
  try {
    return symrig::apps::run(argc, argv);
  } catch (const std::bad_alloc&) {
    symrig::write_standard_error("symrig: out of memory; use a smaller grid or a machine with more memory\n");
  } catch (const std::exception& error) {
    symrig::apps::print_error("", std::string("internal fault: ") + error.what());
  }
  return symrig::apps::kFault;
}
