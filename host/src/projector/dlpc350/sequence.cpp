// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc350/sequence.hpp"

#include <cmath>

#include <fmt/format.h>

namespace symrig::projector::dlpc350 {
namespace {

std::uint8_t bit(bool set, unsigned place) {
  return static_cast<std::uint8_t>(set ? 1U << place : 0U);
}

}  // namespace

std::array<std::uint8_t, kEntryBytes> to_bytes(const TableEntry& entry) {
  const auto first = static_cast<unsigned>(entry.trigger) | static_cast<unsigned>(entry.plane & 0x3F) << 2U;
  const auto second =
      static_cast<unsigned>(entry.bits & 0xF) | static_cast<unsigned>(entry.leds & dlp::kAllLeds) << 4U;
  const auto third =
      bit(entry.inverted, 0) | bit(entry.black_after, 1) | bit(entry.swaps_buffer, 2) | bit(entry.joins, 3);
  return {static_cast<std::uint8_t>(first), static_cast<std::uint8_t>(second),
          static_cast<std::uint8_t>(third)};
}

TableEntry entry_of(std::span<const std::uint8_t, kEntryBytes> bytes) {
  TableEntry entry;
  entry.trigger = static_cast<Trigger>(bytes[0] & 3U);
  entry.plane = bytes[0] >> 2U;
  entry.bits = bytes[1] & 0xF;
  entry.leds = static_cast<std::uint8_t>(bytes[1] >> 4U & dlp::kAllLeds);
  entry.inverted = (bytes[2] & 1U) != 0;
  entry.black_after = (bytes[2] & 2U) != 0;
  entry.swaps_buffer = (bytes[2] & 4U) != 0;
  entry.joins = (bytes[2] & 8U) != 0;
  return entry;
}

std::vector<TableEntry> video_table(int planes, std::uint8_t leds) {
  std::vector<TableEntry> table(static_cast<std::size_t>(planes));
  for (int k = 0; k < planes; ++k) {
    TableEntry& entry = table[static_cast<std::size_t>(k)];
    entry.trigger = k == 0 ? Trigger::rising : Trigger::continues;
    entry.plane = k;
    entry.leds = leds;
    entry.swaps_buffer = k == 0;
    entry.black_after = k + 1 == planes;
  }
  return table;
}

Result<std::uint8_t> delay_code(Nanoseconds delay) {
  const auto units = std::lround(static_cast<double>(delay.count()) / kDelayUnit);
  const long code = kNoDelay + units;
  if (code >= 0 && code <= kMostDelay) return static_cast<std::uint8_t>(code);
  return Error{ErrorCode::bad_argument,
               fmt::format("a trigger output cannot be delayed by {:.2f} us",
                           1e-3 * static_cast<double>(delay.count())),
               "give -20.05 us to 2.78 us"};
}

}  // namespace symrig::projector::dlpc350
