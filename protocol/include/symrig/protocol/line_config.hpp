// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

constexpr unsigned kWordLines = 32;  ///< bits of a word of levels on the wire
/// Lines of a board. A board with little memory keeps fewer than a word has: its build defines
/// SYMRIG_MAX_LINES.
#ifdef SYMRIG_MAX_LINES
constexpr unsigned kMaxLines = SYMRIG_MAX_LINES;
#else
constexpr unsigned kMaxLines = kWordLines;
#endif
constexpr unsigned kWordOutputs = 28;  ///< outputs are among the first 28: SetWord carries that many
/// Lines 0 to kMaxOutputs - 1 may be outputs. A board with little memory defines SYMRIG_MAX_OUTPUTS.
#ifdef SYMRIG_MAX_OUTPUTS
constexpr unsigned kMaxOutputs = SYMRIG_MAX_OUTPUTS;
#else
constexpr unsigned kMaxOutputs = kMaxLines < kWordOutputs ? kMaxLines : kWordOutputs;
#endif
static_assert(kMaxLines >= 1 && kMaxLines <= kWordLines);
static_assert(kMaxOutputs >= 1 && kMaxOutputs <= kMaxLines && kMaxOutputs <= kWordOutputs);
constexpr uint32_t kOutputMask = (uint32_t{1} << kMaxOutputs) - 1;

/// The configuration of one line, which both sides hash. Times in ticks; 0 = no limit.
struct LineConfig {
  bool configured = false;
  bool output = false;
  uint8_t role = 0;
  uint8_t hazard = 0;
  bool safe_level = false;
  bool capture = false;
  uint64_t max_on = 0;
  uint64_t min_off = 0;
  uint16_t max_duty_permille = 0;
  bool trip_level = false;  ///< of an interlock input

  constexpr bool limited() const { return max_on != 0 || min_off != 0 || max_duty_permille != 0; }
};

/// The configuration of a whole board, by line number.
struct BoardConfig {
  LineConfig lines[kMaxLines];

  /// The line of a number from the wire. A number that no line of this build has is not configured.
  constexpr LineConfig line(unsigned number) const {
    return number < kMaxLines ? lines[number] : LineConfig();
  }

  /// Clears line by line: a temporary of the whole is too large for a small board's stack.
  constexpr void clear() {
    for (LineConfig& line : lines) line = {};
  }

  /// Lines whose edges are needed: the host captures them, or they have limits.
  constexpr uint32_t watched_lines() const {
    uint32_t watched = 0;
    for (unsigned k = 0; k < kMaxLines; ++k)
      if (lines[k].configured && (lines[k].capture || lines[k].limited())) watched |= uint32_t{1} << k;
    return watched;
  }

  /// The safe levels of the outputs: bit k is line k.
  constexpr uint32_t safe_levels() const {
    uint32_t levels = 0;
    for (unsigned k = 0; k < kMaxLines; ++k)
      if (lines[k].configured && lines[k].output && lines[k].safe_level) levels |= uint32_t{1} << k;
    return levels;
  }
};

constexpr size_t kLineRecordSize = 24;

/// Writes a configured line in the form for hash and storage (PROTOCOL.md gives the bytes).
constexpr void put_line_record(uint8_t number, const LineConfig& line, uint8_t* out) {
  out[0] = number;
  out[1] = line.output ? 1 : 0;
  out[2] = line.role;
  out[3] = line.hazard;
  out[4] = line.safe_level ? 1 : 0;
  out[5] = static_cast<uint8_t>((line.capture ? 1U : 0U) | (line.trip_level ? 2U : 0U));
  put_u16(out + 6, line.max_duty_permille);
  put_u64(out + 8, line.max_on);
  put_u64(out + 16, line.min_off);
}

/// The inverse of put_line_record(). The line's number is in[0].
constexpr LineConfig get_line_record(const uint8_t* in) {
  LineConfig line;
  line.configured = true;
  line.output = in[1] != 0;
  line.role = in[2];
  line.hazard = in[3];
  line.safe_level = in[4] != 0;
  line.capture = (in[5] & 1U) != 0;
  line.trip_level = (in[5] & 2U) != 0;
  line.max_duty_permille = get_u16(in + 6);
  line.max_on = get_u64(in + 8);
  line.min_off = get_u64(in + 16);
  return line;
}

/// The hash of a configuration in FinalizeConfig: CRC-32C over the records of all configured lines, in order
/// of line number.
constexpr uint32_t config_hash(const BoardConfig& config) {
  Crc32c crc;
  for (unsigned k = 0; k < kMaxLines; ++k) {
    if (!config.lines[k].configured) continue;
    uint8_t record[kLineRecordSize] = {};
    put_line_record(static_cast<uint8_t>(k), config.lines[k], record);
    crc.add({record, sizeof record});
  }
  return crc.value();
}

}  // namespace symrig::protocol
