// SPDX-License-Identifier: Apache-2.0
#include "symrig/conformance/conformance.hpp"

#include "conformance/board_under_test.hpp"
#include "conformance/check.hpp"
#include "conformance/raw_session.hpp"
#include "symrig/board/internal/explain.hpp"

#include <algorithm>
#include <array>
#include <regex>

#include <fmt/format.h>

namespace symrig {

std::string_view name(CheckOutcome outcome) {
  switch (outcome) {
    case CheckOutcome::passed:
      return "pass";
    case CheckOutcome::failed:
      return "fail";
    case CheckOutcome::skipped:
      return "skip";
  }
  return "?";
}

}  // namespace symrig

namespace symrig::conformance {
namespace {

std::string code_text(std::uint32_t code) {
  if (code == kNoCode) return "no answer";
  return fmt::format("{} ({})", code, board::explain_code(code).name);
}

}  // namespace

Verdict failed(std::string detail) {
  return {CheckOutcome::failed, std::move(detail)};
}

Verdict skipped(std::string why) {
  return {CheckOutcome::skipped, std::move(why)};
}

Verdict same(std::string_view what, std::uint64_t expected, std::uint64_t got) {
  if (expected == got) return {};
  return failed(fmt::format("{}: expected {}, got {}", what, expected, got));
}

Verdict within(std::string_view what, std::uint64_t low, std::uint64_t high, std::uint64_t got) {
  if (low <= got && got <= high) return {};
  return failed(fmt::format("{}: expected {} to {}, got {}", what, low, high, got));
}

Verdict that(bool holds, std::string_view what) {
  if (holds) return {};
  return failed(fmt::format("not fulfilled: {}", what));
}

Verdict code_is(std::string_view what, std::uint32_t expected, std::uint32_t got) {
  if (expected == got) return {};
  return failed(fmt::format("{}: expected code {}, got {}", what, code_text(expected), code_text(got)));
}

}  // namespace symrig::conformance

namespace symrig {
namespace {

using conformance::BoardUnderTest;
using conformance::Check;
using conformance::Verdict;

std::vector<Check> all_checks() {
  using namespace conformance;
  std::vector<Check> all;
  for (const auto group : {identity_checks(), wire_checks(), event_checks(), state_checks(), upload_checks(),
                           rule_checks(), program_checks(), limit_checks(), interlock_checks(),
                           host_loss_checks(), receipt_checks(), clock_checks(), jumper_checks()})
    all.insert(all.end(), group.begin(), group.end());
  return all;
}

Result<std::vector<Check>> chosen_checks(const std::string& filter) {
  std::vector<Check> chosen = all_checks();
  if (filter.empty()) return chosen;
  try {
    const std::regex wanted(filter);
    std::erase_if(chosen, [&](const Check& check) {
      return !std::regex_search(check.name.begin(), check.name.end(), wanted);
    });
  } catch (const std::regex_error&) {
    return Error{ErrorCode::bad_argument, fmt::format("'{}' is not a regular expression", filter),
                 "for example ^wire or host_loss"};
  }
  if (!chosen.empty()) return chosen;
  return Error{ErrorCode::bad_argument, fmt::format("no check's name matches '{}'", filter),
               "docs/conformance.md lists them"};
}

/// Number of the line of that name and direction. fails: bad_argument.
Result<std::uint32_t> find_line(const BoardUnderTest& board, const std::string& name, bool output) {
  std::string known;
  for (const symrig_wire_LineReply& line : board.lines) {
    if ((protocol::raw(line.direction) == symrig_wire_Direction_DIRECTION_OUTPUT) != output) continue;
    if (name == line.name) return line.line;
    known += (known.empty() ? "" : ", ") + std::string(line.name);
  }
  return Error{ErrorCode::bad_argument,
               fmt::format("the board has no {} '{}'", output ? "output" : "input", name), known};
}

Result<void> wire_jumper(BoardUnderTest& board, const Jumper& jumper) {
  SYMRIG_TRY(const std::uint32_t output, find_line(board, jumper.output, true));
  SYMRIG_TRY(const std::uint32_t input, find_line(board, jumper.input, false));
  if (board.lines[input].stamp_ticks == 0)
    return Error{ErrorCode::bad_argument, fmt::format("the board does not time-stamp '{}'", jumper.input),
                 "put the jumper on an input with stamps (symrig info)"};
  board.jumper = {output, input};
  return {};
}

Verdict make_once(const Check& check, BoardUnderTest& board) {
  Verdict verdict = board.start_afresh();
  if (!verdict) verdict.detail = "before the check: " + verdict.detail;
  return verdict ? check.run(board) : verdict;
}

/// A best-effort board on a busy machine may underrun. It tells so, its outputs are safe then, and the check
/// is made again.
CheckResult make(const Check& check, BoardUnderTest& board) {
  constexpr int kAttempts = 3;
  Verdict verdict = make_once(check, board);
  for (int k = 1; k < kAttempts && verdict.outcome == CheckOutcome::failed && board.underran(); ++k) {
    verdict = board.outputs_safe();
    if (!verdict) break;
    verdict = make_once(check, board);
  }
  return {std::string(check.name), verdict.outcome, std::move(verdict.detail)};
}

Result<void> make_all(std::span<const Check> checks, BoardUnderTest& board, const ConformanceOptions& options,
                      ConformanceReport& report) {
  for (const Check& check : checks) {
    if (options.stop && options.stop()) return Error{ErrorCode::interrupted, "stopped; the board is safe"};
    report.results.push_back(make(check, board));
    if (board.session.lost()) return *board.session.lost();
    if (options.on_result) options.on_result(report.results.back());
  }
  return {};
}

}  // namespace

std::size_t ConformanceReport::count(CheckOutcome outcome) const {
  return static_cast<std::size_t>(
      std::count_if(results.begin(), results.end(),
                    [outcome](const CheckResult& result) { return result.outcome == outcome; }));
}

bool ConformanceReport::passed() const {
  return count(CheckOutcome::failed) == 0 && count(CheckOutcome::passed) > 0;
}

std::vector<CheckInfo> conformance_checks() {
  std::vector<CheckInfo> infos;
  for (const Check& check : all_checks()) infos.push_back({check.name, check.what});
  return infos;
}

Result<ConformanceReport> check_conformance(std::unique_ptr<Link> link, const ConformanceOptions& options) {
  SYMRIG_TRY(const auto checks, chosen_checks(options.filter));
  BoardUnderTest board(std::move(link));
  if (const Verdict met = board.meet(); !met) {
    if (board.session.lost()) return *board.session.lost();
    return Error{ErrorCode::device_lost, met.detail,
                 "check its power and cable, and that no other program uses it"};
  }
  if (options.jumper) SYMRIG_CHECK(wire_jumper(board, *options.jumper));
  ConformanceReport report{board.who.board, board.who.firmware_version, "", {}};
  for (pb_size_t k = 0; k < board.who.unique_id.size; ++k)
    report.unique_id += fmt::format("{:02x}", board.who.unique_id.bytes[k]);
  const Result<void> made = make_all(checks, board, options, report);
  board.leave_safe();
  if (!made) return made.error();
  return report;
}

}  // namespace symrig
