// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/compile.hpp"

#include "command.hpp"
#include "output.hpp"
#include "program_input.hpp"
#include "symrig/base/files.hpp"

#include <memory>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::apps {
namespace {

struct CompileArguments {
  std::string file, output, board = "sim:", json;
};

std::string to_json(const CompiledProgram& program, std::uint32_t config_hash) {
  const auto per_pattern =
      program.patterns == 0
          ? nlohmann::ordered_json()
          : nlohmann::ordered_json(seconds(program.expected) / static_cast<double>(program.patterns));
  const nlohmann::ordered_json json{
      {"command", "compile"},
      {"board", program.board.board},
      {"program_hash", fmt::format("{:08x}", program.program.hash())},
      {"config_hash", fmt::format("{:08x}", config_hash)},
      {"records", program.program.records()},
      {"steps", program.steps},
      {"patterns", program.patterns},
      {"exposures", program.exposures},
      {"seconds",
       {{"expected", seconds(program.expected)},
        {"shortest", seconds(program.shortest)},
        {"longest", seconds(program.longest)},
        {"per_pattern", per_pattern}}},
      {"on_time_us",
       program.on_time ? nlohmann::ordered_json(1e6 * seconds(*program.on_time)) : nlohmann::ordered_json()}};
  return json_text(json, 1);
}

Result<void> run(const CompileArguments& arguments) {
  SYMRIG_CHECK(program_files(arguments.file, arguments.board)
                   .writes("-o", arguments.output, FileFormat::program)
                   .writes("--json", arguments.json, FileFormat::json)
                   .check());
  SYMRIG_TRY(const auto file, read_program_file(arguments.file));
  SYMRIG_TRY(const auto board, board_info_of(arguments.board));
  const auto compilation = compile_program(file, board);
  if (!compilation.ok()) return first_error(arguments.file, compilation);
  const CompiledProgram& program = *compilation.program;
  SYMRIG_TRY(const std::uint32_t config, config_hash(program));
  const auto bytes = symprog_bytes(program);
  SYMRIG_CHECK(write_file_atomically(arguments.output, std::as_bytes(std::span(bytes))));
  SYMRIG_CHECK(write_text(arguments.json, to_json(program, config)));
  if (is_standard_output(arguments.json)) return {};
  SYMRIG_CHECK(print_findings(arguments.file, compilation.findings, Severity::warning));
  return print(fmt::format("{} for board '{}': ", arguments.output, board.board) + program_summary(program));
}

}  // namespace

Job add_compile(CLI::App& command) {
  const auto arguments = std::make_shared<CompileArguments>();
  command.add_option("file", arguments->file, "Program file (TOML)")->required()->type_name("scan.toml");
  command.add_option("-o,--output", arguments->output, "Compiled program to write")
      ->required()
      ->type_name("scan.symprog");
  command
      .add_option("--board", arguments->board,
                  "The board that will run it: a URI, or a file that describes the board")
      ->type_name("URI|FILE")
      ->capture_default_str();
  add_json(command, arguments->json);
  command.footer(std::string("Example:\n"
                             "  symrig compile scan.toml -o scan.symprog\n"
                             "\n"
                             "docs/program-file.md describes both kinds of file.\n\n") +
                 kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
