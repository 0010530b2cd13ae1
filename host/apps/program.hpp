// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "command.hpp"
#include "symrig/report/summary.hpp"

#include <span>
#include <string>
#include <vector>

namespace symrig::apps {

/// A program with commands.
struct Program {
  std::string name;         ///< "symrig"
  const char* about;        ///< what it does, after its name in the manual page
  const char* description;  ///< of the help
  const char* footer;       ///< of the help
  std::span<const Command> commands;
  void (*prepare)();  ///< called before a job: what signals do
  bool boards;        ///< some of its commands talk to boards
};

/// `symrig`.
const Program& symrig_program();

/// Declares a program, its commands and their options. Returns the jobs in the order of its commands. What is
/// declared here is all that help, manual pages and completions show.
std::vector<Job> declare(CLI::App& app, const Program& program);

/// Parses the words and runs the job that they ask for. Prints what went wrong. Returns the exit code. main()
/// calls it once.
int run_program(const Program& program, int argc, char** argv);

/// From now on this process keeps the memory that it frees. Photographs are allocated and freed in batches.
/// Returning their memory to the system each time takes longer than merging them (docs/benchmarks.md).
/// run_program() calls it.
void keep_freed_memory();

/// The name of the program that runs, for messages; "symrig" before run_program().
const std::string& program_name();

/// Quotes words as one line that a shell splits into the same words. Control characters become '?'.
std::string shell_line(std::span<const char* const> words);

/// Stores the command line. main calls this once. The first word becomes the name of the program, whatever
/// the path of the command.
void remember_command_line(int argc, const char* const* argv);

/// The present time, this version, and the stored command line.
Made made_now();

}  // namespace symrig::apps
