// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"
#include "symrig/board/ticks.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A GPIO line as the board names it. Its index in BoardInfo::lines is its number on the wire.
struct LineInfo {
  std::string name;
  bool output = false;
  std::string pin = std::string();  ///< as the board's maker calls it ("GPIO16"); may be empty
  std::uint8_t waits = 7;           ///< inputs, edges to wait for: bit 0 rising, 1 falling, 2 both
  bool trips = false;               ///< inputs: may be an interlock
  std::uint32_t stamp_ticks = 0;    ///< resolution of its time-stamps; 0 = its edges are not seen
};

/// Who a board is (Hello) and what it can do (Capabilities).
struct BoardInfo {
  std::string board;                ///< "sim", "pico"
  std::string firmware_version;     ///< "0.1.0"
  std::string unique_id;            ///< hexadecimal
  std::uint64_t firmware_hash = 0;  ///< of the firmware's sources
  std::uint32_t schema_hash = 0;    ///< of symrig.proto
  std::uint32_t protocol_major = 0;
  std::uint32_t protocol_minor = 0;
  std::uint32_t features = 0;  ///< bits a host may ignore
  std::uint32_t required = 0;  ///< bits a host must know, or stay away

  TickRate rate;
  std::vector<LineInfo> lines;
  Ticks min_dwell;                  ///< shortest hold of one word
  Ticks max_dwell;                  ///< longest hold of one record (longer holds take more records)
  Ticks wait_latency;               ///< from an awaited edge to the next word, at most
  std::uint32_t program_bytes = 0;  ///< room for a program
  std::uint32_t loop_depth = 0;
  std::uint32_t mtu = 0;     ///< bytes of a decoded frame, at most
  std::uint32_t window = 0;  ///< frames in flight to the board, at most
  std::string label;         ///< as stored on the board by its user; may be empty
  // What the board needs to keep its edge engine fed (rule refill); refill_ticks 0 = nothing.
  std::uint32_t queue_segments = 2;
  std::uint32_t refill_ticks = 0;
  std::uint32_t poll_ticks = 0;
  /// How late a word may go out: 0 where hardware makes the edges, else the board is best effort.
  Ticks lateness{};

  bool best_effort() const { return lateness.count != 0; }

  /// -1 if there is no such line.
  int line(std::string_view name) const;
};

/// What happens if a line stays on when it should not. lamp and laser lines may be armed only with a
/// keep-alive.
enum class Hazard : std::uint8_t { benign = 0, lamp = 1, laser = 2 };

/// How a line is to be used. Limits of 0 (and a duty of 1) mean "none".
struct LineConfig {
  std::string line;
  bool safe_level = false;  ///< outputs: level in SAFE, after a fault, an abort, or host loss
  Hazard hazard = Hazard::benign;
  bool capture = false;    ///< report the line's edges (inputs and outputs)
  Nanoseconds max_on{0};   ///< longest time away from the safe level
  Nanoseconds min_off{0};  ///< shortest time at the safe level between two times away from it
  /// inputs: the line is an interlock. While it stands at this level nothing may be armed, and when it comes
  /// to it the board falls to its safe levels by itself and faults.
  std::optional<bool> trip_level = std::nullopt;
  double max_duty = 1;  ///< on / (on + the off that follows), each pulse, in (0, 1], steps of 1/1000
};

}  // namespace symrig
