// SPDX-License-Identifier: Apache-2.0
#include "board/session/jumper_test.hpp"

#include "board/session/names.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <fmt/format.h>

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
