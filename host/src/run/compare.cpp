// SPDX-License-Identifier: Apache-2.0
#include "symrig/run/compare.hpp"

#include "symrig/protocol/program.hpp"

#include <algorithm>
#include <array>
#include <cstdlib>

namespace symrig {
namespace {

constexpr std::size_t kLines = 32;
using EdgesByLine = std::array<std::vector<CapturedEdge>, kLines>;

EdgesByLine by_line(std::span<const CapturedEdge> edges) {
  EdgesByLine lines;
  for (const CapturedEdge& edge : edges)
    if (edge.line >= 0 && static_cast<std::size_t>(edge.line) < kLines) lines[edge.line].push_back(edge);
  return lines;
}

bool matches(EdgeKind kind, bool level) {
  return kind == EdgeKind::both || (kind == EdgeKind::rising) == level;
}

/// When the waits of a run ended, from its receipt.
class RunEdges {
 public:
  RunEdges(const Program& program, Ticks wait_latency, std::uint32_t captured, const Receipt& receipt)
      : view_{{program.bytes().data(), program.bytes().size()}},
        wait_latency_(wait_latency),
        captured_(captured),
        receipt_(receipt),
        lines_(by_line(receipt.edges)) {}

  std::optional<Ticks> operator()(const PlannedWait& wait) const {
    const bool captured = ((captured_ >> static_cast<unsigned>(wait.line)) & 1U) != 0;
    return captured ? from_edges(wait) : from_marks(wait);
  }

 private:
  std::optional<Ticks> from_edges(const PlannedWait& wait) const {
    const auto& edges = lines_[wait.line];
    auto edge = std::lower_bound(edges.begin(), edges.end(), wait.begin,
                                 [](const CapturedEdge& e, Ticks tick) { return e.tick < tick; });
    while (edge != edges.end() && !matches(wait.edge, edge->level)) ++edge;
    if (edge == edges.end() || edge->tick - wait.begin > wait.timeout) return std::nullopt;
    return edge->tick;
  }

  /// The tick of the next mark minus the words between the wait and the mark, which have known durations.
  std::optional<Ticks> from_marks(const PlannedWait& wait) const {
    Ticks words;
    auto record = static_cast<std::uint32_t>(wait.record + 1);
    for (; record < view_.size() && view_[record].is(protocol::Op::set_word); ++record)
      words = words + Ticks{view_[record].ticks};
    const bool marked = record < view_.size() && view_[record].is(protocol::Op::mark);
    if (!marked || wait.marks >= receipt_.marks.size()) return wait.begin;
    const Ticks mark = receipt_.marks[wait.marks].tick;
    const Ticks before = words + wait_latency_;
    return mark < before ? wait.begin : mark - before;
  }

  protocol::ProgramView view_;
  Ticks wait_latency_;
  std::uint32_t captured_;
  const Receipt& receipt_;
  EdgesByLine lines_;
};

std::uint32_t captured_lines(const BoardInfo& board, std::span<const LineConfig> lines) {
  std::uint32_t mask = 0;
  for (const LineConfig& line : lines)
    if (const int k = board.line(line.line); k >= 0 && line.capture) mask |= 1U << static_cast<unsigned>(k);
  return mask;
}

void compare_line(std::span<const PlannedEdge> planned, std::span<const CapturedEdge> captured,
                  Comparison& out) {
  std::size_t p = 0;
  std::size_t c = 0;
  while (p < planned.size() || c < captured.size()) {
    const bool no_plan = p == planned.size();
    const bool no_edge = c == captured.size();
    if (!no_plan && !no_edge && planned[p].level == captured[c].level) {
      out.pairs.push_back({planned[p++], captured[c++].tick});
    } else if (no_edge || (!no_plan && planned[p].tick <= captured[c].tick)) {
      out.missing.push_back(planned[p++]);
    } else {
      out.unplanned.push_back(captured[c++]);
    }
  }
}

void summarise(Comparison& out) {
  std::stable_sort(out.pairs.begin(), out.pairs.end(),
                   [](const EdgePair& a, const EdgePair& b) { return a.planned.tick < b.planned.tick; });
  double sum = 0;
  for (const EdgePair& pair : out.pairs) {
    out.largest = std::max<std::int64_t>(out.largest, std::abs(pair.late()));
    sum += static_cast<double>(pair.late());
  }
  if (!out.pairs.empty()) out.mean = sum / static_cast<double>(out.pairs.size());
}

}  // namespace

std::uint32_t watched_outputs(const BoardInfo& board, std::span<const LineConfig> lines) {
  std::uint32_t outputs = 0;
  for (std::size_t k = 0; k < board.lines.size() && k < kLines; ++k)
    if (board.lines[k].output) outputs |= 1U << k;
  return captured_lines(board, lines) & outputs;
}

std::uint32_t safe_levels(const BoardInfo& board, std::span<const LineConfig> lines) {
  std::uint32_t levels = 0;
  for (const LineConfig& line : lines)
    if (const int k = board.line(line.line); k >= 0 && line.safe_level)
      levels |= 1U << static_cast<unsigned>(k);
  return levels;
}

Result<Timeline> plan_of_run(const Program& program, const BoardInfo& board,
                             std::span<const LineConfig> lines, const Receipt& receipt,
                             std::size_t max_edges) {
  TimelineOptions options;
  options.start = receipt.started;
  options.initial_levels = safe_levels(board, lines);
  options.max_edges = max_edges;
  options.edge_at = RunEdges(program, board.wait_latency, captured_lines(board, lines), receipt);
  return expand(program, board, options);
}

Comparison compare(const Timeline& plan, std::span<const CapturedEdge> captured, std::uint32_t watched) {
  std::array<std::vector<PlannedEdge>, kLines> planned;
  for (const PlannedEdge& edge : plan.edges) planned[edge.line].push_back(edge);
  const EdgesByLine seen = by_line(captured);
  Comparison out;
  for (std::size_t k = 0; k < kLines; ++k)
    if (((watched >> k) & 1U) != 0) compare_line(planned[k], seen[k], out);
  summarise(out);
  return out;
}

}  // namespace symrig
