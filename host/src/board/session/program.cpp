// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/program.hpp"

#include "symrig/base/time.hpp"
#include "symrig/board/internal/board_forms.hpp"
#include "symrig/board/internal/explain.hpp"
#include "symrig/protocol/check_program.hpp"
#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/program.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include <fmt/format.h>

namespace symrig {

using protocol::Op;

std::uint32_t Program::hash() const {
  return protocol::crc32c({bytes_.data(), bytes_.size()});
}

Result<Program> Program::from_bytes(std::vector<std::uint8_t> bytes) {
  if (bytes.empty() || bytes.size() % protocol::kRecordSize != 0)
    return Error{ErrorCode::bad_format,
                 fmt::format("a program of {} bytes has an incomplete record", bytes.size()),
                 "records have 8 bytes each"};
  Program program;
  program.bytes_ = std::move(bytes);
  return program;
}

ProgramBuilder::ProgramBuilder(BoardInfo board) : board_(std::move(board)) {}

void ProgramBuilder::fail(ErrorCode code, std::string what, std::string hint) {
  if (state_) state_ = Error{code, std::move(what), std::move(hint)};
}

int ProgramBuilder::output(std::string_view line) {
  const int index = board_.line(line);
  if (index >= 0 && static_cast<unsigned>(index) < protocol::kMaxOutputs && board_.lines[index].output)
    return index;
  fail(ErrorCode::unknown_name, fmt::format("the board has no output '{}'", line),
       board::line_hint(board_, line, true));
  return -1;
}

void ProgramBuilder::put(std::uint32_t word, std::uint32_t ticks) {
  std::array<std::uint8_t, protocol::kRecordSize> record{};
  protocol::put_u32(record.data(), word);
  protocol::put_u32(record.data() + 4, ticks);
  if (bytes_.size() + record.size() > board_.program_bytes)
    return fail(ErrorCode::limit,
                fmt::format("the program is longer than the board's {} bytes", board_.program_bytes),
                "use loops, or split the program");
  bytes_.insert(bytes_.end(), record.begin(), record.end());
}

namespace {

std::uint32_t word_of(Op op, std::uint32_t arg) {
  return (static_cast<std::uint32_t>(op) << 28U) | arg;
}

}  // namespace

ProgramBuilder& ProgramBuilder::set(std::string_view line, bool level) {
  const int index = output(line);
  if (index < 0) return *this;
  const std::uint32_t bit = 1U << static_cast<unsigned>(index);
  levels_ = level ? levels_ | bit : levels_ & ~bit;
  pending_ = true;
  return *this;
}

ProgramBuilder& ProgramBuilder::hold(Nanoseconds duration) {
  if (duration.count() < 0) {
    fail(ErrorCode::bad_argument, "a hold is negative", "give a duration");
    return *this;
  }
  return hold(board_.rate.ticks(duration));
}

ProgramBuilder& ProgramBuilder::hold(Ticks duration) {
  if (duration < board_.min_dwell) {
    fail(ErrorCode::bad_argument,
         fmt::format("a hold of {} is shorter than the board's shortest",
                     board::ticks_text(board_, duration.count)),
         "hold for at least " + board::ticks_text(board_, board_.min_dwell.count));
    return *this;
  }
  // Records of max_dwell. The last two share the rest, so that none becomes shorter than min_dwell.
  std::uint64_t left = duration.count;
  const std::uint64_t longest = board_.max_dwell.count;
  while (left > 0 && state_) {
    std::uint64_t now = std::min(left, longest);
    if (left > longest && left - longest < board_.min_dwell.count) now = left / 2;
    put(word_of(Op::set_word, levels_), static_cast<std::uint32_t>(now));
    left -= now;
  }
  pending_ = false;
  return *this;
}

ProgramBuilder& ProgramBuilder::pulse(std::string_view line, Nanoseconds width) {
  return set(line, true).hold(width).set(line, false);
}

/// If lines were set without a hold, holds them for min_dwell.
void ProgramBuilder::flush() {
  if (pending_) hold(board_.min_dwell);
}

ProgramBuilder& ProgramBuilder::loop(std::uint64_t rounds) {
  flush();
  if (rounds == 0 || rounds > protocol::kMaxRounds)
    fail(ErrorCode::bad_argument, fmt::format("a loop has {} rounds", rounds),
         "give 1 to 4294967296 rounds, or nest loops");
  if (loops_.size() == board_.loop_depth)
    fail(ErrorCode::bad_argument, "loops are nested too deeply",
         fmt::format("the board allows {} levels", board_.loop_depth));
  loops_.push_back({levels_});
  const protocol::Record record = protocol::make_loop(std::min(rounds, protocol::kMaxRounds));
  put(word_of(Op::loop, record.arg), record.ticks);
  return *this;
}

ProgramBuilder& ProgramBuilder::end_loop() {
  flush();
  if (loops_.empty()) {
    fail(ErrorCode::bad_argument, "end_loop without loop", "close each loop once");
    return *this;
  }
  const std::uint32_t changed = loops_.back().levels ^ levels_;
  loops_.pop_back();
  for (std::size_t k = 0; k < board_.lines.size(); ++k)
    if (((changed >> k) & 1U) != 0)
      fail(ErrorCode::bad_argument,
           fmt::format("a loop ends with another level of {} than it began", board::line_text(board_, k)),
           "set the line back before end_loop");
  put(word_of(Op::end_loop, 0), 0);
  return *this;
}

ProgramBuilder& ProgramBuilder::wait_edge(std::string_view line, EdgeKind edge, Nanoseconds timeout,
                                          OnTimeout action) {
  flush();
  const int index = board_.line(line);
  const bool input = index >= 0 && !board_.lines[index].output;
  if (!input)
    fail(ErrorCode::unknown_name, fmt::format("the board has no input '{}'", line),
         board::line_hint(board_, line, false));
  const Ticks limit = board_.rate.ticks(std::max(timeout, Nanoseconds{0}));
  if (timeout.count() <= 0 || limit.count == 0 || limit > board_.max_dwell)
    fail(ErrorCode::bad_argument,
         fmt::format("a time-out of {} is out of range", base::duration_text(timeout)),
         "give more than 0 and at most " + board::ticks_text(board_, board_.max_dwell.count));
  if (!state_) return *this;
  const protocol::Record record = protocol::make_wait(
      {static_cast<std::uint8_t>(index), static_cast<protocol::WaitFor>(edge), action == OnTimeout::abort},
      static_cast<std::uint32_t>(limit.count));
  put(word_of(Op::wait_edge, record.arg), record.ticks);
  return *this;
}

ProgramBuilder& ProgramBuilder::mark(std::uint32_t id) {
  if (id > protocol::kMaxArg)
    fail(ErrorCode::bad_argument, fmt::format("mark {} is too large", id), "use ids below 2^28");
  put(word_of(Op::mark, id & protocol::kMaxArg), 0);
  return *this;
}

Result<Program> ProgramBuilder::end() {
  if (!loops_.empty()) fail(ErrorCode::bad_argument, "a loop is not closed", "call end_loop for each loop");
  put(word_of(Op::end, levels_), 0);
  if (!state_) return state_.error();
  return Program::from_bytes(bytes_);
}

std::string Finding::line_of_text() const {
  const std::string where = line.empty() ? "" : fmt::format("line '{}' ", line);
  return fmt::format("record {}: {}{}: {}; {}", record, where, rule, what, alternative);
}

std::vector<Finding> lint(const Program& program, const BoardInfo& board, std::span<const LineConfig> lines) {
  std::vector<Finding> findings;
  const auto config = board::line_setup(board, lines);
  if (!config) {
    findings.push_back({"config", 0, "", config.error().what, config.error().hint});
    return findings;
  }
  protocol::ProgramTiming timing;
  protocol::check_program({{program.bytes().data(), program.bytes().size()}},
                          board::program_rules(board, *config), timing,
                          [&](const protocol::Violation& violation) {
                            findings.push_back(board::explain(violation, board));
                            return true;
                          });
  return findings;
}

}  // namespace symrig
