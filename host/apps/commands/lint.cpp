// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "console.hpp"
#include "files.hpp"
#include "json_text.hpp"
#include "program_input.hpp"

#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

struct LintArguments {
  std::string file, board = "sim:", json;
};

std::string to_json(const LintArguments& arguments, const Compilation& compilation) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const FileFinding& finding : compilation.findings)
    list.push_back({{"line", finding.place},
                    {"severity", name(finding.severity)},
                    {"rule", finding.rule},
                    {"what", finding.what},
                    {"alternative", finding.alternative}});
  const nlohmann::ordered_json json{
      {"command", "lint"}, {"file", arguments.file}, {"ok", compilation.ok()}, {"findings", std::move(list)}};
  return json_text(json, 1);
}

Result<void> run(const LintArguments& arguments) {
  SYMRIG_TRY(auto source, program_source(arguments.file, arguments.board));
  SYMRIG_CHECK(source.files.writes("--json", arguments.json, FileFormat::json).check());
  SYMRIG_TRY(const auto program, source.read());
  SYMRIG_TRY(const auto board, board_info_of(arguments.board));
  const auto compilation = compile_program(program, board);
  SYMRIG_CHECK(write_text(arguments.json, to_json(arguments, compilation)));
  if (!is_standard_output(arguments.json)) {
    SYMRIG_CHECK(print_findings(arguments.file, compilation.findings, Severity::note));
    if (compilation.ok())
      SYMRIG_CHECK(print(fmt::format("{}: no errors for board '{}'; ", arguments.file, board.board) +
                         program_summary(*compilation.program)));
  }
  if (compilation.ok()) return {};
  const auto& all = compilation.findings;
  const auto errors = std::count_if(
      all.begin(), all.end(), [](const FileFinding& finding) { return finding.severity == Severity::error; });
  return Error{ErrorCode::bad_value,
               fmt::format("{}: {} error{}", arguments.file, errors, errors == 1 ? "" : "s"),
               "each error is listed with the nearest legal alternative"};
}

}  // namespace

Job add_lint(CLI::App& command) {
  const auto arguments = std::make_shared<LintArguments>();
  command.add_option("file", arguments->file, "Program file (TOML); - is standard input")
      ->required()
      ->type_name("scan.toml");
  command
      .add_option("--board", arguments->board,
                  "The board that will run it: a URI, or a file that describes the board")
      ->type_name("URI|FILE")
      ->capture_default_str();
  add_json(command, arguments->json);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig lint scan.toml --board sim:\n"
          "  generate-scan | symrig lint -\n"
          "\n"
          "Each finding is FILE:LINE: severity: rule: what; alternative. docs/lint-rules.md explains the "
          "rules.\n"
          "Errors give exit code 4; warnings and notes do not.\n"
          "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
