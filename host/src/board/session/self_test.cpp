// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/self_test.hpp"

#include "board/session/jumper_test.hpp"
#include "board/session/names.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
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
