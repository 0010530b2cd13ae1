// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <functional>
#include <string>

#include <CLI/CLI.hpp>

namespace symrig::apps {

/// What a command does after its options are parsed. An Error becomes one line on standard error; its code
/// gives the exit code.
using Job = std::function<Result<void>()>;

/// Each function declares one subcommand with its options and its help, and returns its job.
Job add_bench(CLI::App& app);
Job add_calibrate(CLI::App& app);
Job add_capture(CLI::App& app);
Job add_compile(CLI::App& app);
Job add_conformance(CLI::App& app);
Job add_dual(CLI::App& app);
Job add_evaluate(CLI::App& app);
Job add_fit(CLI::App& app);
Job add_flash(CLI::App& app);
Job add_identify(CLI::App& app);
Job add_info(CLI::App& app);
Job add_inspect(CLI::App& app);
Job add_lint(CLI::App& app);
Job add_list(CLI::App& app);
Job add_relight(CLI::App& app);
Job add_report(CLI::App& app);
Job add_run(CLI::App& app);
Job add_selftest(CLI::App& app);
Job add_trace(CLI::App& app);

/// The option `--json FILE`. "-" is standard output.
inline void add_json(CLI::App& command, std::string& file) {
  command.add_option("--json", file, "Also write the numbers as JSON; - is standard output")
      ->type_name("FILE");
}

/// Shown at the end of each command's help.
inline constexpr const char* kExitCodes =
    "Exit codes: 0 done, 2 usage, 3 device, 4 bad input, 5 fault or limit (5 also when stopped by Ctrl-C).";

}  // namespace symrig::apps
