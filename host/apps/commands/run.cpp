// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/run.hpp"

#include "command.hpp"
#include "meter.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program_input.hpp"
#include "symrig/board/link.hpp"
#include "symrig/run/waveform.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <array>
#include <memory>

#include <fmt/format.h>

namespace symrig::apps {
namespace {

struct RunArguments {
  std::string file, device, output, vcd;
  bool clear_fault = false;
};

/// What is known before the board is open: the program, and what its file states about the rig.
struct Plan {
  std::optional<ProgramFile> file;
  std::optional<CompiledProgram> compiled;

  RigWiring wiring() const { return file ? wiring_of(file->rig) : compiled->wiring; }
  Nanoseconds keep_alive() const { return file ? file->rig.keep_alive : compiled->keep_alive; }
};

Result<Plan> load(const std::string& path) {
  Plan plan;
  SYMRIG_TRY(const bool compiled, is_compiled(path));
  if (compiled) {
    SYMRIG_TRY(plan.compiled, load_compiled(path));
  } else {
    SYMRIG_TRY(plan.file, read_program_file(path));
  }
  return plan;
}

/// Opens the board. "sim:" is a simulated rig with the wiring of the program.
Result<std::unique_ptr<Link>> open(const std::string& device, const Plan& plan) {
  if (device == "sim:") return make_sim_rig(plan.wiring());
  SYMRIG_TRY(const auto uri, choose_board(device));
  return open_link(uri);
}

Result<CompiledProgram> compile_for(const Plan& plan, const std::string& path, const BoardInfo& board) {
  if (plan.compiled) return *plan.compiled;
  auto compilation = compile_program(*plan.file, board);
  if (!compilation.ok()) return first_error(path, compilation);
  return *std::move(compilation.program);
}

std::string vcd_of(const RunRecord& record) {
  const BoardInfo& board = record.program.board;
  std::array<Waveform, 2> both{waveform(record.plan, board, "plan"), waveform(record.plan, board, "actual")};
  both[1].edges = record.receipt.edges;
  return vcd_text(both);
}

std::string summary(const RunRecord& record) {
  const Comparison& all = record.differences;
  const double tick = 1e9 / static_cast<double>(record.program.board.rate.hz);
  std::string text = fmt::format("{} on board '{}' in {}: {} words", name(record.receipt.end),
                                 record.program.board.board, duration(seconds(record.receipt.duration())),
                                 grouped(static_cast<double>(record.receipt.steps)));
  text += fmt::format("; {} planned edges captured, largest difference {:.6g} ns, {} missing, {} unplanned\n",
                      grouped(static_cast<double>(all.pairs.size())), static_cast<double>(all.largest) * tick,
                      all.missing.size(), all.unplanned.size());
  if (record.ledger) text += record.ledger->summary() + "\n";
  return text;
}

Result<RunRecord> run_it(Board& board, const CompiledProgram& program, bool clear_fault) {
  Meter meter("run", program.is_scan ? "patterns" : "marks");
  const Progress report = meter.progress();
  RunOptions options;
  options.clear_fault = clear_fault;
  options.progress = [&report, &program](const RunProgress& at) {
    const auto done = program.is_scan ? at.patterns : at.marks;
    return report({"running", static_cast<std::int64_t>(done), static_cast<std::int64_t>(at.patterns_asked)});
  };
  return run_program(board, program, options);
}

Result<void> run(const RunArguments& arguments) {
  SYMRIG_CHECK(program_files(arguments.file, "")
                   .writes("-o", arguments.output, FileFormat::json)
                   .writes("--vcd", arguments.vcd, FileFormat::waveform)
                   .check());
  SYMRIG_TRY(const Plan plan, load(arguments.file));
  SYMRIG_TRY(auto link, open(arguments.device, plan));
  BoardOptions options;
  options.keep_alive = plan.keep_alive();
  SYMRIG_TRY(auto board, Board::connect(std::move(link), options));
  SYMRIG_TRY(const auto program, compile_for(plan, arguments.file, board.info()));
  SYMRIG_TRY(const auto record, run_it(board, program, arguments.clear_fault));
  SYMRIG_CHECK(write_text(arguments.output, receipt_json(record)));
  SYMRIG_CHECK(write_text(arguments.vcd, vcd_of(record)));
  if (const auto error = run_error(record)) return *error;
  const bool printed = is_standard_output(arguments.output) || is_standard_output(arguments.vcd);
  return printed ? Result<void>() : print(summary(record));
}

}  // namespace

Job add_run(CLI::App& command) {
  const auto arguments = std::make_shared<RunArguments>();
  command.add_option("file", arguments->file, "Program file (TOML), or a compiled one")
      ->required()
      ->type_name("scan.toml|scan.symprog");
  add_device(command, arguments->device);
  command.add_option("-o,--output", arguments->output, "Receipt to write; - is standard output")
      ->type_name("receipt.json");
  command
      .add_option("--vcd", arguments->vcd,
                  "VCD file to write, with planned and captured edges, for a waveform viewer")
      ->type_name("FILE");
  command.add_flag("--clear-fault", arguments->clear_fault,
                   "First clear a fault that an earlier run has latched");
  add_progress(command);
  command.footer(
      std::string(
          "Example:\n"
          "  symrig run scan.toml --device sim: -o receipt.json --vcd run.vcd\n"
          "\n"
          "Ctrl-C or SIGTERM aborts the run: the outputs go to their safe levels at once, the command "
          "writes the receipt,\n"
          "and the exit code is 5. If the command dies, the board's keep-alive makes the outputs safe.\n"
          "\n") +
      kExitCodes);
  return [arguments] { return run(*arguments); };
}

}  // namespace symrig::apps
