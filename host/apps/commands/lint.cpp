// SPDX-License-Identifier: Apache-2.0
#include "command.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program_input.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

struct LintArguments {
  std::string file, board = "sim:", json, rule;
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

std::string indented(std::string_view text) {
  std::string lines;
  std::size_t begin = 0;
  while (begin < text.size()) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    const std::string_view line = text.substr(begin, end - begin);
    lines += line.empty() ? "\n" : fmt::format("  {}\n", line);
    begin = end + 1;
  }
  return lines;
}

std::string explanation_of(const LintRule& rule) {
  const std::string head = fmt::format("{}: {}: {}\n", rule.name, name(rule.severity), rule.about);
  if (rule.explanation.empty())
    return head +
           "\nThe board refuses such a program. protocol/PROTOCOL.md explains the board's own rules.\n";
  return fmt::format("{}\n{}\n\nThis breaks it:\n\n{}\nThis keeps it:\n\n{}", head, rule.explanation,
                     indented(rule.example(rule.breaks)), indented(rule.example(rule.keeps)));
}

std::vector<std::string_view> rule_names() {
  std::vector<std::string_view> names;
  for (const LintRule& rule : lint_rules()) names.push_back(rule.name);
  return names;
}

constexpr const char* kAllRules = "all";

/// Prints one rule with its examples, or a line for each.
Result<void> explain(const std::string& name_of_rule) {
  std::string list;
  for (const LintRule& rule : lint_rules()) {
    if (rule.name == name_of_rule) return print(explanation_of(rule));
    list += fmt::format("{:<26}{:<9}{}\n", rule.name, name(rule.severity), rule.about);
  }
  if (name_of_rule == kAllRules) return print(list);
  return Error{ErrorCode::unknown_name, fmt::format("there is no rule '{}'", name_of_rule),
               nearest_hint(name_of_rule, rule_names())};
}

Result<void> run_or_explain(const CLI::App& command, const LintArguments& arguments) {
  const bool explains = command.count("--explain") > 0;
  if (!explains && arguments.file.empty())
    return Error{ErrorCode::bad_argument, "file is required", "see symrig lint --help"};
  if (!explains) return run(arguments);
  if (!arguments.file.empty() || arguments.rule.empty())
    return Error{ErrorCode::bad_argument,
                 arguments.rule.empty() ? "--explain is empty" : "--explain reads no program file",
                 "give a rule and no file; symrig lint --explain lists the rules"};
  SYMRIG_CHECK(check_effects(
      command, std::array{Idle{"--board", true, "with --explain"}, Idle{"--json", true, "with --explain"}}));
  return explain(arguments.rule);
}

}  // namespace

Job add_lint(CLI::App& command) {
  const auto arguments = std::make_shared<LintArguments>();
  command.add_option("file", arguments->file, "Program file (TOML); - is standard input")
      ->type_name("scan.toml");
  command
      .add_option("--board", arguments->board,
                  "The board that will run it: a URI, or a file that describes the board")
      ->type_name("URI|FILE")
      ->capture_default_str();
  takes_words(
      command
          .add_option("--explain", arguments->rule,
                      "Instead of a file: explain this rule, with examples; without RULE, list all rules")
          ->type_name("RULE")
          ->expected(0, 1)
          ->default_str(kAllRules),
      rule_names());
  add_json(command, arguments->json);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig lint scan.toml --board sim:\n"
          "  generate-scan | symrig lint -\n"
          "  symrig lint --explain camera.readout\n"
          "\n"
          "Each finding is FILE:LINE: severity: rule: what; alternative. If the alternative is a setting, "
          "paste it.\n"
          "Errors give exit code 4; warnings and notes do not.\n"
          "\n") +
      kExitCodes);
  return [&command, arguments] { return run_or_explain(command, *arguments); };
}

}  // namespace symrig::apps
