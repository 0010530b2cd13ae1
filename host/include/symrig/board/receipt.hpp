// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/ticks.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A mark that the board reported.
struct StepMark {
  std::uint32_t id = 0;
  std::uint32_t ordinal = 0;  ///< number of marks before it in this run
  Ticks tick;                 ///< on the board's clock

  bool operator==(const StepMark&) const = default;
};

/// An edge that the board captured on one of its lines.
struct CapturedEdge {
  int line = 0;
  bool level = false;
  Ticks tick;

  bool operator==(const CapturedEdge&) const = default;
};

/// How a run ended. Values are those of the wire; `lost` is not on it: the host has not learnt how the run
/// ended.
enum class RunEnd : std::uint8_t { completed = 0, aborted = 1, wait_timeout = 2, fault = 3, lost = 255 };
std::string_view name(RunEnd end);

/// A latched fault.
struct FaultInfo {
  std::uint32_t code = 0;  ///< FaultCode of the wire
  Ticks tick;
  std::uint64_t arg = 0;  ///< the line for limits, the record for waits, 0 for others
  std::string name;       ///< "max_on"
  std::string hint;       ///< what it means and what to do
};

/// What a run planned and what the board measured.
struct Receipt {
  std::uint32_t program_hash = 0;
  std::uint32_t config_hash = 0;
  std::uint64_t firmware_hash = 0;
  TickRate rate;

  Ticks started;            ///< first word out, on the board's clock
  Ticks planned_min;        ///< duration if every awaited edge comes at once
  Ticks planned_max;        ///< duration if every wait times out
  Ticks actual;             ///< duration measured by the board
  std::uint64_t steps = 0;  ///< words that went out

  std::vector<StepMark> marks;
  std::vector<CapturedEdge> edges;  ///< of lines configured with capture

  std::uint32_t underruns = 0;    ///< the edge engine ran dry
  std::uint32_t late = 0;         ///< words that began later than planned
  std::uint32_t events_lost = 0;  ///< marks or edges lost because the board's memory for events was full
  RunEnd end = RunEnd::completed;
  std::optional<FaultInfo> fault;

  Nanoseconds duration() const { return rate.nanoseconds(actual); }
  /// True if the run completed without faults and without loss.
  bool clean() const {
    return end == RunEnd::completed && underruns == 0 && late == 0 && events_lost == 0 && !fault;
  }
};

}  // namespace symrig
