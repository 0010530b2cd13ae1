// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/crc32c.hpp"
#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

constexpr unsigned kMaxLines = 32;    ///< lines of a board: bits of a word of levels
constexpr unsigned kMaxOutputs = 28;  ///< outputs are among the first 28: SetWord carries that many
constexpr uint32_t kOutputMask = (1U << kMaxOutputs) - 1;

/// How one line is used, as both sides hash it. Times in ticks; 0 = no limit.
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

  constexpr bool limited() const { return max_on != 0 || min_off != 0 || max_duty_permille != 0; }
};

/// The configuration of a whole board, by line number.
struct BoardConfig {
  LineConfig lines[kMaxLines];

  /// Levels that mean "nothing happens": bit k is line k.
  constexpr uint32_t safe_levels() const {
    uint32_t levels = 0;
    for (unsigned k = 0; k < kMaxLines; ++k)
      if (lines[k].configured && lines[k].output && lines[k].safe_level) levels |= 1U << k;
    return levels;
  }
};

/// What FinalizeConfig names a configuration by: CRC-32C over a 24-byte record for every configured line, in
/// order of line number (PROTOCOL.md gives the bytes).
constexpr uint32_t config_hash(const BoardConfig& config) {
  Crc32c crc;
  for (unsigned k = 0; k < kMaxLines; ++k) {
    const LineConfig& line = config.lines[k];
    if (!line.configured) continue;
    uint8_t record[24] = {static_cast<uint8_t>(k), line.output, line.role, line.hazard,
                          line.safe_level,         line.capture};
    put_u16(record + 6, line.max_duty_permille);
    put_u64(record + 8, line.max_on);
    put_u64(record + 16, line.min_off);
    crc.add({record, sizeof record});
  }
  return crc.value();
}

}  // namespace symrig::protocol
