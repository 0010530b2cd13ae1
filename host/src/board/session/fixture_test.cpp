// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/time.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/board/internal/self_test_parts.hpp"
#include "symrig/board/self_test.hpp"

#include <algorithm>
#include <set>
#include <thread>
#include <utility>

#include <fmt/format.h>

namespace symrig::board {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kLook = 10ms;
constexpr Nanoseconds kPatience = 1s;  // twice what a watchdog may take (hal/watchdog.hpp)
constexpr Nanoseconds kAllowed = 500ms;
constexpr Nanoseconds kLeaving = 100ms;  // a board restarts 20 ms after its answer
constexpr double kReturnSeconds = 10;
constexpr int kReturnTries = 40;  // also in virtual time, where seconds of this machine say nothing

/// For how long the board still answers; none: it does not stop within kPatience.
Result<std::optional<Ticks>> answers_for(Board& board) {
  SYMRIG_TRY(const BoardStatus first, board.status());
  const Ticks most = board.info().rate.ticks(kPatience);
  Ticks answered{0};
  while (answered.count < most.count) {
    if (!board.idle(kLook)) return std::optional(answered);
    const auto now = board.status();
    if (!now) return std::optional(answered);
    answered = {now->now.count - first.now.count};
  }
  return std::optional<Ticks>();
}

/// A new session with the same board: over the old link, or over a new one if that has ended.
Result<void> meet_again(Board& board, const Reconnect& reconnect) {
  if (board.rejoin()) return {};
  if (!reconnect) return Error{ErrorCode::device_lost, "its link has ended", ""};
  SYMRIG_TRY(auto again, reconnect());
  board = std::move(again);
  return {};
}

Result<void> wait_for_return(Board& board, const Reconnect& reconnect) {
  const std::string who = board.info().unique_id;
  const Stopwatch watch;
  for (int tries = 0; tries < kReturnTries || watch.seconds() < kReturnSeconds; ++tries) {
    if (!board.idle(kLook)) std::this_thread::sleep_for(kLook);
    if (meet_again(board, reconnect) && board.info().unique_id == who) return {};
  }
  return Error{ErrorCode::device_lost, fmt::format("board {} did not come back after its reset", who),
               "look at its light, then plug it in again"};
}

Result<ResetCause> cause_after_request(Board& board, const Reconnect& reconnect) {
  SYMRIG_CHECK(board.reboot(false));
  static_cast<void>(board.idle(kLeaving));  // the link may end here
  SYMRIG_CHECK(wait_for_return(board, reconnect));
  SYMRIG_TRY(const BoardStatus status, board.status());
  return status.reset_cause;
}

}  // namespace

Result<WatchdogTest> test_watchdog(Board& board, const Reconnect& reconnect) {
  WatchdogTest found;
  SYMRIG_CHECK(board.starve_watchdog());
  SYMRIG_TRY(found.answered, answers_for(board));
  if (!found.answered) {
    found.text = fmt::format("the board still answers {} s after its last feed: nothing resets it",
                             std::chrono::duration<double>(kPatience).count());
    return found;
  }
  SYMRIG_CHECK(wait_for_return(board, reconnect));
  SYMRIG_TRY(const BoardStatus status, board.status());
  found.cause = status.reset_cause;
  const std::string time = ticks_text(board.info(), found.answered->count);
  const bool in_time = found.answered->count <= board.info().rate.ticks(kAllowed).count;
  SYMRIG_TRY(const ResetCause later, cause_after_request(board, reconnect));
  found.passed = in_time && found.cause == ResetCause::watchdog && status.state == BoardState::safe &&
                 later == ResetCause::request;
  found.text = fmt::format("without feeds it answered for {}, then started by {}; after a request by {}",
                           time, name(*found.cause), name(later));
  return found;
}

}  // namespace symrig::board

namespace symrig {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kPulse = 2ms;
constexpr Nanoseconds kGap = 3ms;
constexpr Nanoseconds kTripAllowed = 10us;  // of a board with exact edges
constexpr Nanoseconds kTripAllowedBestEffort = 1ms;
constexpr int kTripAttempts =
    3;  // a falling edge that the board captures after the end of the run is not reported

Result<void> check_plug(const BoardInfo& info, const std::vector<Jumper>& plug) {
  if (plug.size() < 2)
    return Error{ErrorCode::bad_argument, "a plug has at least two wires",
                 "name each as OUT:IN, separated by commas"};
  std::set<std::string> used;
  for (const Jumper& wire : plug) {
    SYMRIG_CHECK(board::check_jumper_lines(info, wire));
    for (const std::string& line : {wire.output, wire.input})
      if (!used.insert(line).second)
        return Error{ErrorCode::bad_argument, fmt::format("the plug has line '{}' twice", line),
                     "a wire joins one output and one input"};
  }
  return {};
}

Result<WireTest> test_wire(Board& board, const Jumper& wire) {
  SelfTest found;
  SYMRIG_CHECK(board::check_jumper(board, wire, found));
  return WireTest{wire, found.passed(), found.checks.back().text, std::move(found.pulses)};
}

/// A pulse on each output, one after the other; a mark before each.
Result<Program> one_after_another(const BoardInfo& info, const std::vector<Jumper>& plug) {
  ProgramBuilder builder(info);
  builder.hold(kGap);
  for (std::size_t k = 0; k < plug.size(); ++k)
    builder.mark(static_cast<std::uint32_t>(k))
        .set(plug[k].output, true)
        .hold(std::max(info.rate.ticks(kPulse), info.min_dwell))
        .set(plug[k].output, false)
        .hold(std::max(info.rate.ticks(kGap), info.min_dwell));
  return builder.end();
}

/// What arrived where it should not, or did not arrive.
std::string crossed(const BoardInfo& info, const std::vector<Jumper>& plug, const Receipt& receipt) {
  if (receipt.marks.size() != plug.size()) return "marks are missing";
  std::vector<int> at_home(plug.size());
  for (const CapturedEdge& edge : receipt.edges) {
    // The last mark before the edge: the pulse that made it. A best-effort board may stamp an edge a little
    // early.
    const Ticks early{info.lateness.count + info.lines[edge.line].stamp_ticks};
    std::size_t pulse = plug.size();
    for (std::size_t k = 0; k < plug.size(); ++k)
      if (receipt.marks[k].tick.count <= edge.tick.count + early.count) pulse = k;
    if (pulse == plug.size()) return fmt::format("'{}' changed before any pulse", info.lines[edge.line].name);
    if (info.line(plug[pulse].input) != edge.line)
      return fmt::format("a pulse of '{}' appeared at '{}': the two wires touch, or the plug is wrong",
                         plug[pulse].output, info.lines[edge.line].name);
    ++at_home[pulse];
  }
  for (std::size_t k = 0; k < plug.size(); ++k)
    if (at_home[k] != 2) return fmt::format("'{}' showed {} edges for one pulse", plug[k].input, at_home[k]);
  return "";
}

Result<SelfCheck> test_crossing(Board& board, const std::vector<Jumper>& plug) {
  SYMRIG_TRY(const Program program, one_after_another(board.info(), plug));
  std::vector<LineConfig> lines;
  for (const Jumper& wire : plug) {
    lines.push_back({.line = wire.output});
    lines.push_back({.line = wire.input, .capture = true});
  }
  SYMRIG_CHECK(board.configure(lines));
  SYMRIG_TRY(const Receipt receipt, board.run(program, 10s));
  const std::string wrong = receipt.end == RunEnd::completed && receipt.events_lost == 0
                                ? crossed(board.info(), plug, receipt)
                                : fmt::format("the run ended with {}", name(receipt.end));
  return SelfCheck{"crossing", wrong.empty(),
                   wrong.empty() ? fmt::format("{} pulses, each at its own input only", plug.size()) : wrong};
}

/// The wire whose input is the interlock, and the wire that shows when the outputs are safe.
struct TripWires {
  Jumper trip, seen;
};

Result<TripWires> trip_wires(const BoardInfo& info, const std::vector<Jumper>& plug) {
  const auto trips = std::find_if(
      plug.begin(), plug.end(), [&](const Jumper& wire) { return info.lines[info.line(wire.input)].trips; });
  if (trips == plug.end())
    return Error{ErrorCode::bad_argument, "no input of the plug can be an interlock",
                 "symrig info lists which can"};
  // The finest stamps show the most.
  const auto stamp = [&](const Jumper& wire) { return info.lines[info.line(wire.input)].stamp_ticks; };
  auto seen = plug.end();
  for (auto wire = plug.begin(); wire != plug.end(); ++wire)
    if (wire != trips && (seen == plug.end() || stamp(*wire) < stamp(*seen))) seen = wire;
  return TripWires{*trips, *seen};
}

Result<Receipt> trip_once(Board& board, const TripWires& wires) {
  const BoardInfo& info = board.info();
  ProgramBuilder builder(info);
  const Ticks word = std::max(info.rate.ticks(kGap), info.min_dwell);
  builder.hold(word).set(wires.seen.output, true).hold(word).set(wires.trip.output, true).hold(100ms);
  SYMRIG_TRY(const Program program,
             builder.set(wires.trip.output, false).set(wires.seen.output, false).end());
  const std::vector<LineConfig> lines{{.line = wires.trip.output},
                                      {.line = wires.seen.output},
                                      {.line = wires.seen.input, .capture = true},
                                      {.line = wires.trip.input, .capture = true, .trip_level = true}};
  SYMRIG_CHECK(board.configure(lines));
  SYMRIG_TRY(auto receipt, board.run(program, 10s));
  SYMRIG_TRY(const BoardStatus status, board.status());
  if (status.fault) SYMRIG_CHECK(board.clear_fault());
  return receipt;
}

std::optional<Ticks> edge_at(const Receipt& receipt, int line, bool level) {
  for (const CapturedEdge& edge : receipt.edges)
    if (edge.line == line && edge.level == level) return edge.tick;
  return std::nullopt;
}

Result<TripTest> test_trip(Board& board, const std::vector<Jumper>& plug) {
  const BoardInfo& info = board.info();
  SYMRIG_TRY(const TripWires wires, trip_wires(info, plug));
  const int trip = info.line(wires.trip.input);
  const int seen = info.line(wires.seen.input);
  TripTest found;
  found.interlock = wires.trip.input;
  found.resolution = {std::uint64_t{info.lines[trip].stamp_ticks} + info.lines[seen].stamp_ticks};
  for (int attempt = 0; attempt < kTripAttempts && !found.latency; ++attempt) {
    SYMRIG_TRY(const Receipt receipt, trip_once(board, wires));
    const bool tripped = receipt.end == RunEnd::fault && receipt.fault &&
                         receipt.fault->name == "interlock" &&
                         receipt.fault->arg == static_cast<std::uint64_t>(trip);
    if (!tripped) {
      found.text =
          fmt::format("'{}' did not trip: the run ended with {}", found.interlock, name(receipt.end));
      return found;
    }
    const auto opened = edge_at(receipt, trip, true);
    const auto safe = edge_at(receipt, seen, false);
    if (opened && safe) found.latency = {safe->count > opened->count ? safe->count - opened->count : 0};
  }
  if (!found.latency) {
    found.text = "the interlock tripped, but the board reported no edge of the falling output";
    return found;
  }
  const bool best_effort = info.lateness.count > 0;
  const Ticks allowed = info.rate.ticks(best_effort ? kTripAllowedBestEffort : kTripAllowed);
  found.passed = found.latency->count <= allowed.count + found.resolution.count;
  found.text =
      fmt::format("from '{}' to safe outputs: {}, known to {}, allowed {}", found.interlock,
                  board::ticks_text(info, found.latency->count),
                  board::ticks_text(info, found.resolution.count), board::ticks_text(info, allowed.count));
  return found;
}

}  // namespace

bool FixtureTest::passed() const {
  return basics.passed() && crossing.passed && trip.passed && watchdog.passed &&
         std::all_of(wires.begin(), wires.end(), [](const WireTest& wire) { return wire.passed; });
}

std::vector<Jumper> default_plug(const BoardInfo& board) {
  std::vector<std::string> outputs;
  std::vector<std::string> inputs;
  for (const LineInfo& line : board.lines) (line.output ? outputs : inputs).push_back(line.name);
  std::vector<Jumper> plug;
  for (std::size_t k = 0; k < std::min(outputs.size(), inputs.size()); ++k)
    plug.push_back({outputs[k], inputs[k]});
  return plug;
}

Result<FixtureTest> fixture_test(Board& board, const std::vector<Jumper>& plug,
                                 const SelfTestOptions& options, const Reconnect& reconnect) {
  SYMRIG_CHECK(check_plug(board.info(), plug));
  SYMRIG_CHECK(trip_wires(board.info(), plug));
  FixtureTest found;
  SYMRIG_TRY(found.basics, self_test(board, options));
  if (!found.basics.passed()) return found;
  for (const Jumper& wire : plug) {
    SYMRIG_TRY(auto tested, test_wire(board, wire));
    found.wires.push_back(std::move(tested));
  }
  SYMRIG_TRY(found.crossing, test_crossing(board, plug));
  SYMRIG_TRY(found.trip, test_trip(board, plug));
  SYMRIG_TRY(found.watchdog, board::test_watchdog(board, reconnect));
  return found;
}

}  // namespace symrig
