// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc900/table.hpp"

#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace symrig::projector::dlpc900 {

dlp::Bytes to_bytes(const TableEntry& entry) {
  dlp::Bytes bytes;
  dlp::append(bytes, static_cast<std::uint32_t>(entry.index), 2);
  dlp::append(bytes, entry.exposure_us, 3);
  bytes.push_back(static_cast<std::uint8_t>((entry.clears ? 1 : 0) | (entry.bits - 1) << 1U |
                                            (entry.leds & dlp::kAllLeds) << 4U | (entry.waits ? 0x80 : 0)));
  dlp::append(bytes, entry.dark_us, 3);
  bytes.push_back(entry.no_trigger_2 ? 1 : 0);
  dlp::append(bytes, static_cast<std::uint32_t>(entry.bit) << 11U, 2);  // bits 10:0 are not for video
  return bytes;
}

std::vector<TableEntry> video_table(const dlp::Sequence& sequence) {
  std::vector<TableEntry> table(static_cast<std::size_t>(sequence.planes));
  for (int k = 0; k < sequence.planes; ++k) {
    TableEntry& entry = table[static_cast<std::size_t>(k)];
    entry.index = k;
    entry.exposure_us = sequence.exposure_us;
    entry.dark_us = sequence.period_us - sequence.exposure_us;
    entry.leds = sequence.leds;
    entry.waits = k == 0;
    entry.clears = k + 1 == sequence.planes;
    entry.bit = k;
  }
  return table;
}

std::optional<Mirrors> mirrors_of(std::uint8_t type) {
  static constexpr std::array<std::pair<std::uint8_t, Mirrors>, 5> kTypes{{{1, {"DLP6500", {1080, 1920}}},
                                                                           {2, {"DLP9000", {1600, 2560}}},
                                                                           {3, {"DLP670S", {1600, 2716}}},
                                                                           {4, {"DLP500YX", {1200, 2048}}},
                                                                           {5, {"DLP5500", {768, 1024}}}}};
  for (const auto& [number, mirrors] : kTypes)
    if (number == type) return mirrors;
  return std::nullopt;
}

Result<std::int16_t> delay_us(Nanoseconds delay) {
  constexpr long kLeast = -20, kMost = 20'000;
  const long us = std::lround(1e-3 * static_cast<double>(delay.count()));
  if (us >= kLeast && us <= kMost) return static_cast<std::int16_t>(us);
  return Error{ErrorCode::bad_argument, fmt::format("a trigger output cannot be delayed by {} us", us),
               fmt::format("give {} us to {} us", kLeast, kMost)};
}

}  // namespace symrig::projector::dlpc900
