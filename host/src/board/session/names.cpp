// SPDX-License-Identifier: Apache-2.0
#include "board/session/names.hpp"

#include "symrig/base/text.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board.hpp"
#include "symrig/protocol/messages.hpp"

#include <vector>

#include <fmt/format.h>

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

}  // namespace symrig::board
