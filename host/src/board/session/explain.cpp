// SPDX-License-Identifier: Apache-2.0
// What a board's states, codes, faults and refusals are called, in texts and in JSON.

#include "symrig/board/internal/explain.hpp"

#include "symrig/base/text.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board.hpp"
#include "symrig/protocol/messages.hpp"

#include <vector>

#include <fmt/format.h>

namespace symrig {

std::string_view name(RunEnd end) {
  switch (end) {
    case RunEnd::completed:
      return "completed";
    case RunEnd::aborted:
      return "aborted";
    case RunEnd::wait_timeout:
      return "wait_timeout";
    case RunEnd::fault:
      return "fault";
    case RunEnd::lost:
      return "lost";
  }
  return "unknown";
}

std::string_view name(BoardState state) {
  switch (state) {
    case BoardState::boot:
      return "boot";
    case BoardState::safe:
      return "safe";
    case BoardState::configured:
      return "configured";
    case BoardState::loaded:
      return "loaded";
    case BoardState::armed:
      return "armed";
    case BoardState::running:
      return "running";
    case BoardState::done:
      return "done";
    case BoardState::fault:
      return "fault";
  }
  return "unknown";
}

std::string_view name(ResetCause cause) {
  switch (cause) {
    case ResetCause::power:
      return "power";
    case ResetCause::pin:
      return "pin";
    case ResetCause::watchdog:
      return "watchdog";
    case ResetCause::request:
      return "request";
  }
  return "unknown";
}

}  // namespace symrig

namespace symrig::board {

Explained explain_fault(std::uint32_t fault) {
  switch (fault) {
    case symrig_wire_FaultCode_FAULT_UNDERRUN:
      return {"underrun", "the firmware did not keep the edge engine filled: use longer holds"};
    case symrig_wire_FaultCode_FAULT_MAX_ON:
      return {"max_on", "a line stayed on beyond its limit: find the cause before you clear the fault"};
    case symrig_wire_FaultCode_FAULT_MIN_OFF:
      return {"min_off",
              "a line went on again before its rest was over: find the cause before you clear the fault"};
    case symrig_wire_FaultCode_FAULT_DUTY:
      return {"duty", "a line rested too little after its pulse: find the cause before you clear the fault"};
    case symrig_wire_FaultCode_FAULT_KEEP_ALIVE:
      return {"keep_alive",
              "the host sent nothing for longer than its keep-alive: check the host's load and the cable"};
    case symrig_wire_FaultCode_FAULT_LINK_LOST:
      return {"link_lost", "the link to the host closed: check the cable"};
    case symrig_wire_FaultCode_FAULT_CAPTURE_OVERFLOW:
      return {"capture_overflow",
              "edges came faster than the board can record them: use longer holds or slower inputs"};
    case symrig_wire_FaultCode_FAULT_INTERNAL:
      return {"internal", "the firmware found an error in itself: please report it with the receipt"};
    case symrig_wire_FaultCode_FAULT_INTERLOCK:
      return {"interlock", "an interlock line opened: close it, then clear the fault"};
    case symrig_wire_FaultCode_FAULT_WATCHDOG:
      return {"watchdog", "the firmware stopped responding and was reset: please report it with the receipt"};
    case symrig_wire_FaultCode_FAULT_CHATTER:
      return {"chatter", "an input changes faster than the board can follow: check its wire and its source"};
    default:
      return {"unknown", "the board's firmware is newer than this host: update the host"};
  }
}

Explained explain_code(std::uint32_t code) {
  switch (code) {
    case symrig_wire_Code_CODE_DECODE:
      return {"decode", "host and board have different schemas: update the older one"};
    case symrig_wire_Code_CODE_UNKNOWN_REQUEST:
      return {"unknown_request", "update the board's firmware"};
    case symrig_wire_Code_CODE_BAD_STATE:
      return {"bad_state", "see the states in firmware/README.md"};
    case symrig_wire_Code_CODE_BAD_VALUE:
      return {"bad_value", "a value is out of range"};
    case symrig_wire_Code_CODE_NO_SUCH_LINE:
      return {"no_such_line", "`symrig info` lists the board's lines"};
    case symrig_wire_Code_CODE_WRONG_DIRECTION:
      return {"wrong_direction", "`symrig info` lists the board's lines"};
    case symrig_wire_Code_CODE_HASH_MISMATCH:
      return {"hash_mismatch", "the board has another configuration or program: configure and upload again"};
    case symrig_wire_Code_CODE_TOO_LONG:
      return {"too_long", "use loops, or split the program"};
    case symrig_wire_Code_CODE_BAD_CHUNK:
      return {"bad_chunk", "upload the program again"};
    case symrig_wire_Code_CODE_INCOMPLETE:
      return {"incomplete", "upload the program again"};
    case symrig_wire_Code_CODE_BAD_PROGRAM:
      return {"bad_program", "lint the program before uploading it"};
    case symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED:
      return {"keep_alive_needed",
              "lamp and laser lines need a keep-alive (a laser one of at most 500 ms): set "
              "BoardOptions::keep_alive"};
    case symrig_wire_Code_CODE_COOLING:
      return {"cooling", "wait for the rest, then start again"};
    case symrig_wire_Code_CODE_IN_PAST:
      return {"in_past", "choose a later tick"};
    case symrig_wire_Code_CODE_VERSION:
      return {"version", "host and board use different versions of the protocol: update the older one"};
    case symrig_wire_Code_CODE_NOT_URGENT:
      return {"not_urgent", "only abort and time requests may be urgent"};
    case symrig_wire_Code_CODE_INTERLOCK_OPEN:
      return {"interlock_open", "close the interlock, then try again"};
    case symrig_wire_Code_CODE_NOT_STORED:
      return {"not_stored", "the board's memory did not store it: the memory may be worn out"};
    case symrig_wire_Code_CODE_BUSY:
      return {"busy", "end the other program that uses the board, then connect again"};
    default:
      return {"unknown", "the board's firmware is newer than this host: update the host"};
  }
}

std::string line_text(const BoardInfo& info, std::uint64_t line) {
  if (line < info.lines.size()) return fmt::format("line '{}'", info.lines[line].name);
  return fmt::format("line {}", line);
}

std::string ticks_text(const BoardInfo& info, std::uint64_t ticks) {
  return fmt::format("{} ({} ticks)", base::duration_text(info.rate.nanoseconds(Ticks{ticks})), ticks);
}

std::string known_lines(const BoardInfo& info, bool output) {
  std::string text;
  for (const LineInfo& line : info.lines)
    if (line.output == output) text += (text.empty() ? "" : ", ") + line.name;
  return text.empty() ? "none" : text;
}

std::string line_hint(const BoardInfo& info, std::string_view given, std::optional<bool> output) {
  std::vector<std::string_view> names;
  for (const LineInfo& line : info.lines)
    if (!output || line.output == *output) names.push_back(line.name);
  std::string text = suggestion(given, names);
  if (output.value_or(true)) text += "outputs: " + known_lines(info, true);
  if (!output) text += "; ";
  return output.value_or(false) ? text : text + "inputs: " + known_lines(info, false);
}

namespace {

using protocol::Rule;
using protocol::Violation;

struct Words {
  const char* rule;
  std::string what;
  std::string alternative;
};

std::string on_for(const Violation& violation, const BoardInfo& info) {
  if (violation.actual >= protocol::kMaxDuration) return "never turned off";
  return "on for " + ticks_text(info, violation.actual);
}

/// Rules about single records and their order.
Words structure_words(const Violation& v, const BoardInfo& info) {
  switch (v.rule) {
    case Rule::length:
      return {
          "length", fmt::format("{} bytes", v.actual),
          fmt::format("give whole records of 8 bytes, at most {} bytes; loops make programs short", v.limit)};
    case Rule::bad_op:
      return {"bad_op", fmt::format("operation {} does not exist", v.actual), "see protocol/PROTOCOL.md"};
    case Rule::bad_arg:
      return {"bad_arg", "bits without a meaning are set", "set them to 0"};
    case Rule::not_an_output:
      return {"not_an_output", "a level for a line that is not an output",
              "outputs: " + known_lines(info, true)};
    case Rule::not_an_input:
      return {"not_an_input", "a wait on a line that is not an input", "inputs: " + known_lines(info, false)};
    case Rule::loop_depth:
      return {"loop_depth", fmt::format("{} loops inside each other", v.actual),
              fmt::format("use at most {}", v.limit)};
    case Rule::loop_balance:
      return {"loop_balance", "loop and end_loop do not pair", "close each loop once"};
    case Rule::loop_rounds:
      return {"loop_rounds", fmt::format("{} rounds", v.actual), "use 1 to 4294967296 rounds, or nest loops"};
    case Rule::idle_loop:
      return {"idle_loop", "the body takes no time", "put a hold into it"};
    case Rule::wait_kind:
      return {"wait_kind", "the board cannot wait for this edge on this line",
              "`symrig info` lists the edges that a program can wait for on each line"};
    case Rule::mark_crowd:
      return {"mark_crowd", fmt::format("{} marks in a row", v.actual),
              fmt::format("put a hold after {} marks", v.limit)};
    case Rule::no_end:
      return {"no_end", "End must be the last record and the only one", "end the program once"};
    default:
      return {"unknown", "a rule that this host does not know", "update the host"};
  }
}

/// Either words are too short (actual < limit, in ticks), or a loop of short words has too many rounds
/// (actual > limit, in rounds).
Words refill_words(const Violation& v, const BoardInfo& info) {
  if (v.actual <= v.limit)
    return {"refill",
            fmt::format("too many words of {} follow each other: the board could not keep up",
                        ticks_text(info, v.actual)),
            fmt::format("hold longer after some hundred short words, or hold each for {}",
                        ticks_text(info, v.limit))};
  return {"refill", fmt::format("{} rounds of short words: the board could not keep up", v.actual),
          fmt::format("use at most {} rounds, or words of {} each", v.limit,
                      ticks_text(info, info.refill_ticks))};
}

Words words(const Violation& v, const BoardInfo& info) {
  const std::string actual = ticks_text(info, v.actual);
  const std::string limit = ticks_text(info, v.limit);
  switch (v.rule) {
    case Rule::min_dwell:
      return {"min_dwell", "held for " + actual, "hold for at least " + limit};
    case Rule::max_dwell:
      return {"max_dwell", "holds or waits for " + actual, "use 1 tick to " + limit + ", or several records"};
    case Rule::too_long:
      return {"too_long", "may run for " + actual + " or more", "stay below " + limit};
    case Rule::max_on:
      return {"max_on", on_for(v, info), "turn it off after at most " + limit};
    case Rule::min_off:
      return {"min_off", "off for only " + actual, "keep it off for at least " + limit};
    case Rule::duty:
      return {"duty", "rests for " + actual + " after its pulse",
              v.limit >= protocol::kMaxDuration ? "turn it off before the end"
                                                : "let it rest for at least " + limit};
    case Rule::refill:
      return refill_words(v, info);
    default:
      return structure_words(v, info);
  }
}

bool about_a_line(Rule rule) {
  return rule == Rule::not_an_output || rule == Rule::not_an_input || rule == Rule::max_on ||
         rule == Rule::min_off || rule == Rule::duty || rule == Rule::wait_kind;
}

std::string detail_text(const symrig_wire_Reply& reply, const BoardInfo& info) {
  switch (protocol::raw(reply.code)) {
    case symrig_wire_Code_CODE_BAD_STATE:
      return fmt::format("not possible in state {}", name(static_cast<BoardState>(reply.detail & 7U)));
    case symrig_wire_Code_CODE_BAD_VALUE:
      return fmt::format("field {} is out of range", reply.field);
    case symrig_wire_Code_CODE_NO_SUCH_LINE:
    case symrig_wire_Code_CODE_WRONG_DIRECTION:
    case symrig_wire_Code_CODE_KEEP_ALIVE_NEEDED:
    case symrig_wire_Code_CODE_INTERLOCK_OPEN:
      return line_text(info, reply.detail);
    case symrig_wire_Code_CODE_HASH_MISMATCH:
      return fmt::format("the board's hash is {:08x}", reply.detail);
    case symrig_wire_Code_CODE_TOO_LONG:
      return fmt::format("at most {} bytes fit", reply.detail);
    case symrig_wire_Code_CODE_BAD_CHUNK:
      return fmt::format("it expects offset {}", reply.detail);
    case symrig_wire_Code_CODE_INCOMPLETE:
      return fmt::format("{} bytes arrived", reply.detail);
    case symrig_wire_Code_CODE_IN_PAST:
      return fmt::format("its clock reads {}", reply.detail);
    default:
      return fmt::format("detail {}", reply.detail);
  }
}

}  // namespace

Finding explain(const Violation& violation, const BoardInfo& info) {
  const Words text = words(violation, info);
  Finding finding{text.rule, violation.record, "", text.what, text.alternative};
  if (about_a_line(violation.rule) && violation.line < info.lines.size())
    finding.line = info.lines[violation.line].name;
  return finding;
}

Error explain_refusal(const symrig_wire_Reply& reply, std::string_view request, const BoardInfo& info) {
  const std::uint32_t code = protocol::raw(reply.code);
  const Explained explained = explain_code(code);
  const bool violation = reply.which_body == symrig_wire_Reply_violation_tag;
  const symrig_wire_Violation& v = reply.body.violation;
  if (code == symrig_wire_Code_CODE_BAD_PROGRAM && violation) {
    const Finding finding =
        explain({static_cast<Rule>(v.rule & 0xFFU), v.record, v.line, v.actual, v.limit}, info);
    return {ErrorCode::device_refused,
            fmt::format("the board refused the program: {}", finding.line_of_text()),
            {}};
  }
  if (code == symrig_wire_Code_CODE_COOLING && violation)
    return {ErrorCode::device_refused,
            fmt::format("the board refused {}: {} must rest for another {}", request, line_text(info, v.line),
                        ticks_text(info, v.limit)),
            std::string(explained.hint)};
  return {ErrorCode::device_refused,
          fmt::format("the board refused {}: {}, {}", request, explained.name, detail_text(reply, info)),
          std::string(explained.hint)};
}

}  // namespace symrig::board
