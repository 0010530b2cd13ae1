// SPDX-License-Identifier: Apache-2.0

#include "command.hpp"
#include "options.hpp"
#include "output.hpp"
#include "program_input.hpp"
#include "symrig/base/files.hpp"
#include "symrig/run/analyser.hpp"
#include "symrig/run/compare.hpp"
#include "symrig/run/run.hpp"
#include "symrig/run/waveform.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::apps {

namespace {

const std::string& name_of(const BoardInfo& board, int line) {
  return board.lines.at(static_cast<std::size_t>(line)).name;
}

std::string unseen_lines(const AnalyserComparison& found, const BoardInfo& board) {
  std::vector<std::string> names;
  for (const int line : found.unseen) names.push_back(name_of(board, line));
  return names.empty()
             ? ""
             : fmt::format("not compared, because no channel shows it: {}\n", fmt::join(names, ", "));
}

/// "LINE=CHANNEL" of --channel.
/// fails: bad_argument.
Result<ChannelName> channel_name(const std::string& text) {
  const std::size_t at = text.find('=');
  if (at == std::string::npos || at == 0 || at + 1 == text.size())
    return Error{ErrorCode::bad_argument, fmt::format("--channel {} is not LINE=CHANNEL", text),
                 "name a line of the board and the analyser's channel, such as camera_trigger=D0"};
  return ChannelName{text.substr(0, at), text.substr(at + 1)};
}

/// What the comparison found, in a few lines for people.
std::string analyser_summary(const AnalyserComparison& found, const BoardInfo& board) {
  std::vector<std::string> names;
  for (const int line : found.lines) names.push_back(name_of(board, line));
  std::string text =
      fmt::format("{} edges of {} paired: {} missing, {} unplanned, {} before or after the run\n",
                  grouped(static_cast<double>(found.pairs.size())), fmt::join(names, ", "), found.missing,
                  found.unplanned, found.outside);
  text +=
      fmt::format("largest difference {:.4g} ns, allowed {:.4g} ns; the analyser's clock is {:.3g} ppm {}\n",
                  found.largest_ns, found.allowed_ns, std::abs(found.rate_ppm),
                  found.rate_ppm < 0 ? "slower than the board's" : "faster than the board's");
  return text + unseen_lines(found, board);
}

/// The pairs as CSV: line, level, planned_ns, seen_ns, difference_ns.
std::string analyser_csv(const AnalyserComparison& found, const BoardInfo& board) {
  std::string text = "line,level,planned_ns,seen_ns,difference_ns\n";
  for (const AnalyserPair& pair : found.pairs)
    text += fmt::format("{},{},{:.3f},{:.3f},{:.3f}\n", name_of(board, pair.line), pair.level ? 1 : 0,
                        pair.planned_ns, pair.seen_ns, pair.difference_ns);
  return text;
}

/// fails: fault, if the analyser saw something else than the plan.
Result<void> analyser_verdict(const AnalyserComparison& found, const std::string& file) {
  if (found.agrees()) return {};
  return Error{
      ErrorCode::fault,
      fmt::format(
          "{} differs from the plan: {} edges missing, {} unplanned, {:.4g} ns apart (allowed {:.4g})", file,
          found.missing, found.unplanned, found.largest_ns, found.allowed_ns),
      "--differences OUT.csv lists each edge; docs/howto-analyser.md names common causes"};
}

struct TraceArguments {
  std::string file, board = "sim:", vcd, wavedrom, differences, capture;
  std::vector<std::string> channels;
  bool plan = false, actual = false;
  std::size_t max_edges = 100'000;
};

/// What to draw.
struct Drawing {
  std::vector<Waveform> waveforms;
  std::string summary;
  std::string differences;  ///< as CSV
  Timeline plan;
  BoardInfo board;
  Result<void> verdict = {};  ///< of the comparison with an analyser
};

/// Waits of a plan end at the projector's next refresh, if its period is known. So the plan is the same in
/// each run, unlike a real run.
TimelineOptions plan_options(const CompiledProgram& program, Nanoseconds refresh, std::size_t max_edges) {
  TimelineOptions options;
  options.max_edges = max_edges;
  options.initial_levels = safe_levels(program.board, program.lines);
  const std::uint64_t period = program.board.rate.ticks(refresh).count;
  if (period > 0)
    options.edge_at = [period](const PlannedWait& wait) {
      return Ticks{(wait.begin.count + period - 1) / period * period};
    };
  return options;
}

Result<Drawing> draw_plan(const CompiledProgram& program, Nanoseconds refresh, std::size_t max_edges) {
  SYMRIG_TRY(const auto plan,
             expand(program.program, program.board, plan_options(program, refresh, max_edges)));
  Drawing drawing;
  drawing.waveforms.push_back(waveform(plan, program.board, "plan"));
  drawing.summary = fmt::format("{} planned edges in {}{}\n", grouped(static_cast<double>(plan.edges.size())),
                                duration(seconds(plan.rate.nanoseconds(plan.end))),
                                plan.cut_off ? " (only the first; --max-edges draws more)" : "");
  drawing.plan = plan;
  drawing.board = program.board;
  return drawing;
}

/// Time since the start of the run; negative for edges before the start.
std::int64_t nanoseconds_since_start(const StoredRun& run, Ticks tick) {
  const Ticks start = run.plan.start;
  return tick < start ? -run.board.rate.nanoseconds(start - tick).count()
                      : run.board.rate.nanoseconds(tick - start).count();
}

std::string differences_csv(const StoredRun& run, const Comparison& all) {
  const double tick = 1e9 / static_cast<double>(run.board.rate.hz);
  std::string text = "line,level,planned_ns,actual_ns,difference_ns\n";
  for (const EdgePair& pair : all.pairs) {
    const std::int64_t planned = nanoseconds_since_start(run, pair.planned.tick);
    text += fmt::format("{},{},{},{},{:.6g}\n",
                        run.board.lines.at(static_cast<std::size_t>(pair.planned.line)).name,
                        pair.planned.level ? 1 : 0, planned, nanoseconds_since_start(run, pair.actual),
                        static_cast<double>(pair.late()) * tick);
  }
  return text;
}

Result<Drawing> draw_receipt(const TraceArguments& arguments, const StoredRun& run) {
  Drawing drawing;
  const bool both = arguments.plan == arguments.actual;
  const auto known = [&run](int line) { return static_cast<std::size_t>(line) < run.board.lines.size(); };
  for (const auto& edge : run.plan.edges)
    if (!known(edge.line))
      return Error{ErrorCode::bad_format, "an edge of a line that the board does not have"};
  Waveform plan = waveform(run.plan, run.board, "plan");
  Waveform actual = plan;
  actual.name = "actual";
  actual.edges = run.captured;
  if (both || arguments.plan) drawing.waveforms.push_back(std::move(plan));
  if (both || arguments.actual) drawing.waveforms.push_back(std::move(actual));
  const auto all = compare(run.plan, run.captured, run.watched);
  const double tick = 1e9 / static_cast<double>(run.board.rate.hz);
  drawing.summary = fmt::format(
      "{} edges paired: largest difference {:.6g} ns, mean {:.6g} ns; {} missing, {} unplanned{}\n",
      grouped(static_cast<double>(all.pairs.size())), static_cast<double>(all.largest) * tick,
      all.mean * tick, all.missing.size(), all.unplanned.size(),
      run.whole ? "" : " (the receipt lists only the first edges)");
  drawing.differences = differences_csv(run, all);
  drawing.plan = run.plan;
  drawing.board = run.board;
  return drawing;
}

Result<CompiledProgram> compile_file(const TraceArguments& arguments, Nanoseconds& refresh) {
  SYMRIG_TRY(const auto file, read_program_file(arguments.file));
  SYMRIG_TRY(const auto board, board_info_of(arguments.board));
  auto compilation = compile_program(file, board);
  if (!compilation.ok()) return first_error(arguments.file, compilation);
  if (file.rig.projector.sync == PatternSync::vsync) refresh = file.rig.projector.refresh;
  return *std::move(compilation.program);
}

/// The kind of the file decides which options have an effect.
enum class Kind { receipt, compiled, program };

/// Refuses options without effect: --board applies to files that this command compiles, --max-edges to plans
/// that it computes.
Result<void> check_trace_effects(const CLI::App& command, Kind kind) {
  const bool nothing_drawn = command.count("--vcd") + command.count("--wavedrom") == 0;
  const std::string unseen = "without --vcd or --wavedrom";
  const std::array<Idle, 7> options{{
      {"--channel", command.count("--compare") == 0, "without --compare"},
      {"--plan", command.count("--actual") > 0, "with --actual: both are drawn by default"},
      {"--plan", nothing_drawn, unseen},
      {"--actual", nothing_drawn, unseen},
      {"--board", kind == Kind::receipt, "with a receipt, which names its board"},
      {"--board", kind == Kind::compiled, "with a compiled program, which is for one board"},
      {"--max-edges", kind == Kind::receipt, "with a receipt: the edges that it contains are drawn"},
  }};
  return check_effects(command, options);
}

Result<Drawing> draw(const CLI::App& command, const TraceArguments& arguments) {
  SYMRIG_TRY(const auto bytes, read_file(arguments.file));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first != std::string_view::npos && text[first] == '{') {
    auto run = read_receipt(text);
    if (run) SYMRIG_CHECK(check_trace_effects(command, Kind::receipt));
    if (!run) return Error{run.error().code, arguments.file + ": " + run.error().what, run.error().hint};
    return draw_receipt(arguments, *run);
  }
  if (arguments.actual || (!arguments.differences.empty() && arguments.capture.empty()))
    return Error{ErrorCode::bad_argument, arguments.file + " is not a receipt: it contains no captured edges",
                 "run the program first: symrig run FILE -o receipt.json"};
  Nanoseconds refresh{0};
  SYMRIG_TRY(const bool compiled, is_compiled(arguments.file));
  SYMRIG_CHECK(check_trace_effects(command, compiled ? Kind::compiled : Kind::program));
  SYMRIG_TRY(const auto program, compiled ? load_compiled(arguments.file) : compile_file(arguments, refresh));
  return draw_plan(program, refresh, arguments.max_edges);
}

/// Compares the plan with what a logic analyser saw, in place of the receipt's edges.
Result<void> compare_capture(const TraceArguments& arguments, Drawing& drawing) {
  std::vector<ChannelName> names;
  for (const std::string& text : arguments.channels) {
    SYMRIG_TRY(auto name, channel_name(text));
    names.push_back(std::move(name));
  }
  SYMRIG_TRY(const auto bytes, read_file(arguments.capture));
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto capture = read_analyser_vcd(text);
  const auto in_file = [&](const Error& error) {
    return Error{error.code, arguments.capture + ": " + error.what, error.hint};
  };
  if (!capture) return in_file(capture.error());
  const auto found = compare_with_analyser(drawing.plan, drawing.board, *capture, names);
  if (!found) return hint_in_command_words(in_file(found.error()));
  drawing.summary += analyser_summary(*found, drawing.board);
  drawing.differences = analyser_csv(*found, drawing.board);
  drawing.verdict = analyser_verdict(*found, arguments.capture);
  return {};
}

Result<void> run(const CLI::App& command, const TraceArguments& arguments) {
  SYMRIG_CHECK(program_files(arguments.file, arguments.board)
                   .reads("--compare", arguments.capture)
                   .writes("--vcd", arguments.vcd, FileFormat::waveform)
                   .writes("--wavedrom", arguments.wavedrom, FileFormat::json)
                   .writes("--differences", arguments.differences, FileFormat::table)
                   .check());
  SYMRIG_TRY(Drawing drawing, draw(command, arguments));
  if (!arguments.capture.empty()) SYMRIG_CHECK(compare_capture(arguments, drawing));
  if (!arguments.vcd.empty()) SYMRIG_CHECK(write_text(arguments.vcd, vcd_text(drawing.waveforms)));
  if (!arguments.wavedrom.empty())
    SYMRIG_CHECK(write_text(arguments.wavedrom, wavedrom_text(drawing.waveforms)));
  SYMRIG_CHECK(write_text(arguments.differences, drawing.differences));
  const bool printed = is_standard_output(arguments.vcd) || is_standard_output(arguments.wavedrom) ||
                       is_standard_output(arguments.differences);
  if (!printed) SYMRIG_CHECK(print(drawing.summary));
  return drawing.verdict;
}

}  // namespace

Job add_trace(CLI::App& command) {
  const auto arguments = std::make_shared<TraceArguments>();
  command.add_option("file", arguments->file, "Program file, compiled program, or receipt of a run")
      ->required()
      ->type_name("FILE|receipt.json");
  command.add_flag("--plan", arguments->plan, "Draw only the planned edges");
  command.add_flag("--actual", arguments->actual, "Draw only the captured edges (of a receipt)");
  command.add_option("--vcd", arguments->vcd, "VCD file to write, for GTKWave or PulseView")
      ->type_name("OUT");
  command.add_option("--wavedrom", arguments->wavedrom, "WaveJSON file to write, for WaveDrom")
      ->type_name("OUT");
  command
      .add_option(
          "--differences", arguments->differences,
          "CSV file to write, with planned and actual time of each edge (of a receipt, or of --compare)")
      ->type_name("OUT");
  command
      .add_option("--compare", arguments->capture,
                  "VCD file of a logic analyser: compare the plan with what it saw")
      ->type_name("VCD");
  command
      .add_option("--channel", arguments->channels,
                  "The analyser's channel at a line, if it does not have the line's name; repeatable")
      ->type_name("LINE=CHANNEL")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  command.add_option("--board", arguments->board, "The board that will run a program file")
      ->type_name("URI|FILE")
      ->capture_default_str();
  command.add_option("--max-edges", arguments->max_edges, "Draw only the first N edges of a plan")
      ->type_name("N")
      ->capture_default_str();
  command.get_option("--max-edges")->check([](const std::string& text) {
    return whole_number_fault(text, 1, 10'000'000);
  });
  command.footer(
      std::string("Example:\n"
                  "  symrig trace receipt.json --vcd run.vcd --wavedrom run.json\n"
                  "\n"
                  "The host computes the plan from the records alone. For waits on the projector it uses the "
                  "refresh of the\n"
                  "profile; a receipt contains the captured edges.\n"
                  "With --compare the exit code is 5 if the analyser saw something else than the plan.\n"
                  "\n") +
      kExitCodes);
  return [&command, arguments] { return run(command, *arguments); };
}

}  // namespace symrig::apps
