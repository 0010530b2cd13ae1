// SPDX-License-Identifier: Apache-2.0
// With a wire from an output to an input, the board stamps its own output edges.
#include "conformance/board_under_test.hpp"
#include "conformance/plan.hpp"

#include <algorithm>
#include <array>
#include <vector>

#include <fmt/format.h>

namespace symrig::conformance {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kNeeds = "needs a jumper from an output to an input";

Bytes pulses(const BoardUnderTest& board, std::uint32_t output) {
  const std::uint32_t bit = 1U << output;
  return pack({word(0, board.word()), loop(100), word(bit, board.word()), word(0, board.word() + 1),
               end_loop(), word(bit, 2 * board.word()), end()});
}

/// Edges by hardware come back late by the same few ticks: the resolution of the time-stamps, and 1 us at
/// most for pads and synchronisers.
Verdict constant_delay(const BoardUnderTest& board, const std::vector<std::uint64_t>& delays,
                       std::uint64_t grain) {
  for (std::size_t k = 0; k < delays.size(); ++k) {
    SYMRIG_MUST(within(fmt::format("ticks from edge {} to its time-stamp", k), 0, board.ticks(1us) + grain,
                       delays[k]));
    SYMRIG_MUST(within(fmt::format("jitter of edge {}, offset by the resolution", k), 0, 2 * (grain - 1),
                       delays[k] + (grain - 1) - delays.front()));
  }
  return {};
}

/// Edges by software: each may be late as the board says, or it is of a word that the board counts as late.
/// One that comes after the end of its word would be an underrun.
Verdict delay_as_told(const BoardUnderTest& board, const std::vector<std::uint64_t>& delays,
                      std::uint64_t grain) {
  const std::uint64_t least = delays.empty() ? 0 : *std::min_element(delays.begin(), delays.end());
  const std::uint64_t in_time =
      board.can.lateness + std::min(board.ticks(1us) + grain, least + 2 * (grain - 1));
  std::size_t late = 0;
  for (std::size_t k = 0; k < delays.size(); ++k) {
    SYMRIG_MUST(within(fmt::format("ticks from edge {} to its time-stamp", k), 0,
                       2 * std::uint64_t{board.word()}, delays[k]));
    if (delays[k] > in_time) ++late;  // every edge of the plan is a word
  }
  return board.late_as_told(late);
}

/// Each edge of the plan comes back.
Verdict stamps(BoardUnderTest& board) {
  if (!board.jumper) return skipped(std::string(kNeeds));
  const auto [output, input] = *board.jumper;
  const std::uint64_t grain = board.lines[input].stamp_ticks;
  board.config.lines[input].capture = true;
  const Bytes program = pulses(board, output);
  SYMRIG_MUST(board.run_to_end(program, 2s));
  board.session.listen_for(kQuietTime);
  const symrig_wire_Event* begun = board.session.last_event(symrig_wire_Event_run_started_tag);
  if (begun == nullptr) return failed("run_started is missing");
  const Plan plan = plan_of(program);
  std::vector<std::uint64_t> delays;
  for (const symrig_wire_Event& event : board.session.events()) {
    if (event.which_body != symrig_wire_Event_edge_tag || event.body.edge.line != input) continue;
    const std::size_t k = delays.size();
    if (k == plan.edges.size()) return failed("more edges came back than went out");
    SYMRIG_MUST(same(fmt::format("level of edge {}", k), plan.edges[k].level, event.body.edge.level));
    delays.push_back(event.body.edge.tick - (begun->body.run_started.tick + plan.edges[k].tick));
  }
  SYMRIG_MUST(board.best_effort() ? delay_as_told(board, delays, grain)
                                  : constant_delay(board, delays, grain));
  return same("edges that came back", plan.edges.size(), delays.size());
}

/// Levels that are set by hand must appear at the input.
Verdict levels(BoardUnderTest& board) {
  if (!board.jumper) return skipped(std::string(kNeeds));
  const auto [output, input] = *board.jumper;
  SYMRIG_MUST(board.configure());
  for (const std::uint32_t level : {1U, 0U, 1U}) {
    SYMRIG_MUST(
        code_is("manual_set", symrig_wire_Code_CODE_OK, board.manual_set(1U << output, level << output)));
    const auto now = board.status();
    if (!now) return failed("no answer to get_status");
    SYMRIG_MUST(same("level at the jumper's input", level, (now->levels >> input) & 1U));
  }
  return {};
}

constexpr std::array<Check, 2> kJumperChecks{{
    {"jumper.levels", "an input follows the output that is wired to it", levels},
    {"jumper.stamps", "every edge comes back, at a constant delay", stamps},
}};

}  // namespace

std::span<const Check> jumper_checks() {
  return kJumperChecks;
}

}  // namespace symrig::conformance
