// SPDX-License-Identifier: Apache-2.0
#include "projector/dlpc350/sequence.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::projector::dlpc350 {
namespace {

/// A source may be this much faster than its mode says.
constexpr double kFastSource = 1e-3;

std::uint8_t bit(bool set, unsigned place) {
  return static_cast<std::uint8_t>(set ? 1U << place : 0U);
}

}  // namespace

std::array<std::uint8_t, kEntryBytes> to_bytes(const TableEntry& entry) {
  const auto first = static_cast<unsigned>(entry.trigger) | static_cast<unsigned>(entry.plane & 0x3F) << 2U;
  const auto second = static_cast<unsigned>(entry.bits & 0xF) | static_cast<unsigned>(entry.leds & kAllLeds)
                                                                    << 4U;
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
  entry.leds = static_cast<std::uint8_t>(bytes[1] >> 4U & kAllLeds);
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

Result<std::uint32_t> longest_period(int planes, Nanoseconds refresh) {
  const double room = 1e-3 * static_cast<double>(refresh.count()) * (1 - kFastSource) - kLoadTime;
  const double period = std::floor(room / planes);
  if (period >= kLeastExposure[0]) return static_cast<std::uint32_t>(period);
  return Error{ErrorCode::limit,
               fmt::format("{} planes do not fit into a refresh of {:.3f} ms: each takes {} us at least",
                           planes, 1e3 * seconds(refresh), kLeastExposure[0]),
               fmt::format("give at most {} planes, or a slower mode",
                           std::max(0, static_cast<int>(room / kLeastExposure[0])))};
}

Result<void> check_sequence(const Sequence& sequence, Nanoseconds refresh) {
  if (sequence.planes < 1 || sequence.planes > kMostPlanes)
    return Error{ErrorCode::bad_argument, fmt::format("a picture has no {} planes", sequence.planes),
                 fmt::format("give 1 to {}", kMostPlanes)};
  if ((sequence.leds & kAllLeds) == 0)
    return Error{ErrorCode::bad_argument, "no LED is selected", "select red, green or blue"};
  if (sequence.exposure_us < kLeastExposure[0])
    return Error{ErrorCode::limit,
                 fmt::format("a plane of {} us is too short for the controller", sequence.exposure_us),
                 fmt::format("give at least {} us", kLeastExposure[0])};
  const bool whole = sequence.exposure_us == sequence.period_us;
  if (!whole && sequence.period_us < sequence.exposure_us + kLoadTime)
    return Error{ErrorCode::limit,
                 fmt::format("a plane of {} us every {} us leaves no time to load the next one",
                             sequence.exposure_us, sequence.period_us),
                 fmt::format("give a period of {} us, or of {} us and more", sequence.exposure_us,
                             sequence.exposure_us + kLoadTime)};
  SYMRIG_TRY(const std::uint32_t most, longest_period(sequence.planes, refresh));
  if (sequence.period_us <= most) return {};
  return Error{ErrorCode::limit,
               fmt::format("{} planes of {} us do not fit into a refresh of {:.3f} ms", sequence.planes,
                           sequence.period_us, 1e3 * seconds(refresh)),
               fmt::format("give a period of at most {} us", most)};
}

}  // namespace symrig::projector::dlpc350
