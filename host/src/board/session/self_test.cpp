// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/self_test.hpp"

#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/board/internal/self_test_parts.hpp"

#include <algorithm>
#include <iterator>
#include <set>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

using namespace std::chrono_literals;
constexpr int kBurst = 8;  // readings without a pause, for a first bound
constexpr std::size_t kMemoryRecords = 2000;

SelfCheck check_identity(const BoardInfo& info) {
  const bool sound = !info.board.empty() && !info.unique_id.empty() && !info.firmware_version.empty();
  return {"identity", sound,
          fmt::format("{} {}, firmware {} ({:016x}), protocol {}.{}", info.board, info.unique_id,
                      info.firmware_version, info.firmware_hash, info.protocol_major, info.protocol_minor)};
}

std::string objection(const BoardInfo& info) {
  std::set<std::string> names;
  for (const LineInfo& line : info.lines) names.insert(line.name);
  if (info.lines.empty()) return "it has no lines";
  if (names.size() != info.lines.size() || names.contains(""))
    return "lines have no name, or two have the same name";
  if (info.program_bytes < 16) return "it has no room for a program";
  if (info.window == 0 || info.mtu < 64) return "it has no room for frames";
  return "";
}

SelfCheck check_abilities(const BoardInfo& info) {
  const auto outputs =
      std::count_if(info.lines.begin(), info.lines.end(), [](const LineInfo& line) { return line.output; });
  const std::string wrong = objection(info);
  return {
      "abilities", wrong.empty(),
      wrong.empty()
          ? fmt::format("{} outputs, {} inputs, {} ns per tick, shortest word {}, room for {} records",
                        outputs, std::ssize(info.lines) - outputs, 1e9 / static_cast<double>(info.rate.hz),
                        board::ticks_text(info, info.min_dwell.count), info.program_bytes / 8)
          : wrong};
}

SelfCheck check_state(const BoardStatus& status) {
  if (status.fault)
    return {"state", false,
            fmt::format("a fault is latched: {} ({})", status.fault->name, status.fault->hint)};
  std::string text = fmt::format("{}, started by {}", name(status.state), name(status.reset_cause));
  if (status.reset_fault) text += fmt::format("; fault before the reset: {}", status.reset_fault->name);
  return {"state", status.reset_cause != ResetCause::watchdog, text};
}

Result<void> check_clock(Board& board, const SelfTestOptions& options, SelfTest& test) {
  ClockModel model(board.info().rate);
  std::vector<Nanoseconds> trips;
  TimeReading reading{};
  for (int k = 0; k < std::max(options.pings, 1); ++k) {
    if (options.progress && !options.progress({"asking for the time", k, options.pings}))
      return Error{ErrorCode::interrupted, "stopped before the board was tested", "run it again"};
    if (k >= kBurst) SYMRIG_CHECK(board.idle(options.between));
    SYMRIG_TRY(reading, board.time());
    trips.push_back(reading.received - reading.sent);
    if (const auto added = model.add(reading); !added) {
      test.checks.push_back({"clock", false, added.error().line()});
      return {};
    }
  }
  std::sort(trips.begin(), trips.end());
  test.pings = {trips.front(), trips[trips.size() / 2], trips.back()};
  SYMRIG_TRY(const auto there, model.board_at(reading.received));
  SYMRIG_TRY(test.drift, model.drift_at(reading.received));
  test.clock_bound = board.info().rate.nanoseconds(there.bound);
  test.checks.push_back(
      {"clock", true,
       fmt::format("{} answers in {} to {} (median {}); clock known to +-{}, drift {:+.1f} to {:+.1f} ppm",
                   trips.size(), base::duration_text(test.pings.shortest),
                   base::duration_text(test.pings.longest), base::duration_text(test.pings.median),
                   base::duration_text(test.clock_bound), 1e6 * test.drift.lowest,
                   1e6 * test.drift.highest)});
  return {};
}

/// A program that fills much of the memory and sets no line. The test never runs it.
Result<Program> filler(const BoardInfo& info) {
  ProgramBuilder builder(info);
  const std::size_t records = std::min(kMemoryRecords, std::size_t{info.program_bytes / 8} - 1);
  const std::uint64_t word = std::max(info.rate.ticks(1ms).count, info.min_dwell.count);
  for (std::size_t k = 0; k < records; ++k) builder.hold(Ticks{word + k});
  return builder.end();
}

Result<void> check_memory(Board& board, SelfTest& test) {
  SYMRIG_TRY(const Program program, filler(board.info()));
  SYMRIG_CHECK(board.configure({}));
  SYMRIG_CHECK(board.upload(program));
  const auto verified = board.verify_program();
  test.checks.push_back({"memory", verified.ok(),
                         verified ? fmt::format("{} records arrived and stayed unchanged", program.records())
                                  : verified.error().line()});
  return {};
}

Result<void> must_be_idle(const BoardStatus& status) {
  if (status.state != BoardState::armed && status.state != BoardState::running) return {};
  return Error{ErrorCode::device_refused, fmt::format("the board is {}", name(status.state)),
               "wait until its program has ended, or abort it"};
}

}  // namespace

bool SelfTest::passed() const {
  return std::all_of(checks.begin(), checks.end(), [](const SelfCheck& check) { return check.passed; });
}

Result<SelfTest> self_test(Board& board, const SelfTestOptions& options) {
  const BoardInfo& info = board.info();
  if (options.jumper) SYMRIG_CHECK(board::check_jumper_lines(info, *options.jumper));
  SYMRIG_TRY(const BoardStatus status, board.status());
  SYMRIG_CHECK(must_be_idle(status));
  SelfTest test;
  test.checks = {check_identity(info), check_abilities(info), check_state(status)};
  SYMRIG_CHECK(check_clock(board, options, test));
  if (status.fault) return test;  // a board in FAULT accepts no configuration
  SYMRIG_CHECK(check_memory(board, test));
  if (options.jumper) SYMRIG_CHECK(board::check_jumper(board, *options.jumper, test));
  return test;
}

}  // namespace symrig

namespace symrig::board {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kWidest = 80ms;
constexpr Nanoseconds kGap = 1ms;
constexpr std::uint64_t kGrowth = 8;       // factor from one width to the next
constexpr std::uint64_t kResolutions = 8;  // width of the shortest pulse in resolutions of the input

Result<int> line_of(const BoardInfo& info, const std::string& name, bool output) {
  const int line = info.line(name);
  if (line < 0)
    return Error{ErrorCode::unknown_name, fmt::format("the board has no line '{}'", name),
                 line_hint(info, name, output)};
  if (info.lines[line].output != output)
    return Error{ErrorCode::bad_argument,
                 fmt::format("line '{}' is not an {}", name, output ? "output" : "input"),
                 fmt::format("a jumper connects an output ({}) to an input ({})", known_lines(info, true),
                             known_lines(info, false))};
  return line;
}

std::uint64_t resolution(const BoardInfo& info, int input) {
  return info.lines[input].stamp_ticks;
}

std::vector<Ticks> widths(const BoardInfo& info, int input) {
  std::vector<Ticks> result;
  const std::uint64_t widest = info.rate.ticks(kWidest).count;
  for (std::uint64_t width = std::max(info.min_dwell.count, kResolutions * resolution(info, input));
       width <= widest; width *= kGrowth)
    result.push_back({width});
  return result;
}

/// A mark before each pulse reports the tick of its rising edge.
Result<Program> pulses(const BoardInfo& info, const std::string& output, const std::vector<Ticks>& widths) {
  ProgramBuilder builder(info);
  builder.hold(kGap);
  for (std::size_t k = 0; k < widths.size(); ++k)
    builder.mark(static_cast<std::uint32_t>(k))
        .set(output, true)
        .hold(widths[k])
        .set(output, false)
        .hold(kGap);
  return builder.end();
}

std::vector<CapturedEdge> edges_of(const Receipt& receipt, int line) {
  std::vector<CapturedEdge> edges;
  std::copy_if(receipt.edges.begin(), receipt.edges.end(), std::back_inserter(edges),
               [line](const CapturedEdge& edge) { return edge.line == line; });
  return edges;
}

bool alternate(const std::vector<CapturedEdge>& edges) {
  for (std::size_t k = 0; k < edges.size(); ++k)
    if (edges[k].level != (k % 2 == 0)) return false;
  return true;
}

std::string pin_of(const BoardInfo& info, const std::string& name) {
  const LineInfo& line = info.lines[info.line(name)];
  return line.pin.empty() ? fmt::format("'{}'", name) : fmt::format("'{}' ({})", name, line.pin);
}

std::uint64_t error_of(const JumperPulse& pulse) {
  return std::max(pulse.planned, pulse.measured).count - std::min(pulse.planned, pulse.measured).count;
}

/// The fault that the edges show, or an empty text. Records the pulses if their number is right.
std::string judge(const BoardInfo& info, const Jumper& jumper, const Receipt& receipt,
                  const std::vector<Ticks>& sent, SelfTest& test) {
  const auto edges = edges_of(receipt, info.line(jumper.input));
  if (edges.empty())
    return fmt::format("no edge arrived: connect {} with {}", pin_of(info, jumper.output),
                       pin_of(info, jumper.input));
  if (edges.size() != 2 * sent.size() || receipt.marks.size() != sent.size() || !alternate(edges))
    return fmt::format("{} edges arrived for {} pulses: a contact is loose, or something else drives {}",
                       edges.size(), sent.size(), pin_of(info, jumper.input));
  for (std::size_t k = 0; k < sent.size(); ++k)
    test.pulses.push_back(
        {sent[k], edges[2 * k + 1].tick - edges[2 * k].tick, edges[2 * k].tick - receipt.marks[k].tick});
  const auto worst = std::max_element(test.pulses.begin(), test.pulses.end(),
                                      [](const auto& a, const auto& b) { return error_of(a) < error_of(b); });
  if (error_of(*worst) > test.stamp_error.count)
    return fmt::format("a pulse of {} was measured as {}", ticks_text(info, worst->planned.count),
                       ticks_text(info, worst->measured.count));
  return "";
}

}  // namespace

Result<void> check_jumper_lines(const BoardInfo& info, const Jumper& jumper) {
  SYMRIG_CHECK(line_of(info, jumper.output, true));
  SYMRIG_TRY(const int input, line_of(info, jumper.input, false));
  if (resolution(info, input) > 0) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("the board does not stamp edges on line '{}'", jumper.input),
               "use an input with stamps (symrig info)"};
}

Result<void> check_jumper(Board& board, const Jumper& jumper, SelfTest& test) {
  const BoardInfo& info = board.info();
  const int input = info.line(jumper.input);
  const auto sent = widths(info, input);
  test.stamp_error = {resolution(info, input) + 1 + info.lateness.count};  // of both edges of a pulse
  SYMRIG_TRY(const Program program, pulses(info, jumper.output, sent));
  const std::vector<LineConfig> lines{{.line = jumper.output}, {.line = jumper.input, .capture = true}};
  SYMRIG_CHECK(board.configure(lines));
  SYMRIG_TRY(const Receipt receipt, board.run(program, 10s));
  const std::string wrong = receipt.clean() ? judge(info, jumper, receipt, sent, test)
                                            : fmt::format("the run ended with {}", name(receipt.end));
  test.checks.push_back(
      {"jumper", wrong.empty(),
       wrong.empty() ? fmt::format("{} pulses from {} to {}, each measured within {}", sent.size(),
                                   ticks_text(info, sent.front().count), ticks_text(info, sent.back().count),
                                   ticks_text(info, test.stamp_error.count))
                     : wrong});
  return {};
}

}  // namespace symrig::board
