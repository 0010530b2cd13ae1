// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// A point or span on the board's clock. A type of its own: only a TickRate converts it to Nanoseconds
/// (host).
struct Ticks {
  std::uint64_t count = 0;

  constexpr auto operator<=>(const Ticks&) const = default;  // NOLINT(modernize-use-nullptr): not a pointer
  constexpr Ticks operator+(Ticks other) const { return {count + other.count}; }
  constexpr Ticks operator-(Ticks other) const { return {count - other.count}; }
};

/// Ticks per second of one board's clock.
struct TickRate {
  std::uint64_t hz = 125'000'000;

  constexpr bool operator==(const TickRate&) const = default;

  /// Nearest tick, halves up. Exact for durations up to 290 years at any rate below 2^63 Hz; t >= 0.
  constexpr Ticks ticks(Nanoseconds t) const {
    const auto whole = static_cast<std::uint64_t>(t.count()) / kNano;
    const auto rest = static_cast<std::uint64_t>(t.count()) % kNano;
    return {whole * hz + (rest * hz + kNano / 2) / kNano};
  }
  /// Nearest nanosecond, halves up.
  constexpr Nanoseconds nanoseconds(Ticks t) const {
    const std::uint64_t whole = t.count / hz;
    const std::uint64_t rest = t.count % hz;
    return Nanoseconds(static_cast<std::int64_t>(whole * kNano + (rest * kNano + hz / 2) / hz));
  }

 private:
  static constexpr std::uint64_t kNano = 1'000'000'000;
};

/// A GPIO line as the board names it. Its index in BoardInfo::lines is its number on the wire.
struct LineInfo {
  std::string name;
  bool output = false;
  std::string pin = std::string();  ///< the board maker's name for it ("GPIO16"); may be empty
  std::uint8_t waits = 7;  ///< inputs: edges that a program can wait for: bit 0 rising, 1 falling, 2 both
  bool trips = false;      ///< inputs: may be an interlock
  std::uint32_t stamp_ticks = 0;  ///< resolution of its time-stamps; 0 = the board stamps no edges here
};

/// The identity of a board (from Hello) and its abilities (from Capabilities).
struct BoardInfo {
  std::string board;                ///< "sim", "pico"
  std::string firmware_version;     ///< "0.1.0"
  std::string unique_id;            ///< hexadecimal
  std::uint64_t firmware_hash = 0;  ///< of the firmware's sources
  std::uint32_t schema_hash = 0;    ///< of symrig.proto
  std::uint32_t protocol_major = 0;
  std::uint32_t protocol_minor = 0;
  std::uint32_t features = 0;  ///< bits a host may ignore
  std::uint32_t required = 0;  ///< a host that does not know one of these bits must not connect

  TickRate rate;
  std::vector<LineInfo> lines;
  Ticks min_dwell;                  ///< shortest hold of one word
  Ticks max_dwell;                  ///< longest hold of one record (longer holds need several records)
  Ticks wait_latency;               ///< from an awaited edge to the next word, at most
  std::uint32_t program_bytes = 0;  ///< room for a program
  std::uint32_t loop_depth = 0;
  std::uint32_t mtu = 0;     ///< bytes of a decoded frame, at most
  std::uint32_t window = 0;  ///< frames in flight to the board, at most
  std::string label;         ///< a name that the user stored on the board; may be empty
  // Limits within which the board can refill its edge engine in time (rule refill); refill_ticks 0 = no
  // limit.
  std::uint32_t queue_segments = 2;
  std::uint32_t refill_ticks = 0;
  std::uint32_t poll_ticks = 0;
  /// The latest that a word may go out after its planned tick. 0 = hardware makes the edges; else the board
  /// is best-effort.
  Ticks lateness{};

  bool best_effort() const { return lateness.count != 0; }

  /// -1 if there is no such line.
  int line(std::string_view name) const;
};

/// The danger if an output stays on. A board with lamp or laser lines arms only with a keep-alive.
enum class Hazard : std::uint8_t { benign = 0, lamp = 1, laser = 2 };

/// The configuration of a line. Limits of 0 (and a duty of 1) mean "none".
struct LineConfig {
  std::string line;
  bool safe_level = false;  ///< outputs: level in SAFE and after a fault, an abort, or host loss
  Hazard hazard = Hazard::benign;
  bool capture = false;    ///< report the line's edges (inputs and outputs)
  Nanoseconds max_on{0};   ///< longest time away from the safe level
  Nanoseconds min_off{0};  ///< shortest time at the safe level between two times away from it
  /// inputs: the line is an interlock. At this level the board cannot be armed. If the line changes to this
  /// level, the board makes its outputs safe by itself and latches a fault.
  std::optional<bool> trip_level = std::nullopt;
  double max_duty = 1;  ///< on / (on + the off that follows), each pulse, in (0, 1], steps of 1/1000
};

/// The properties of a board that programs depend on, as JSON: to compile and lint without the board.
std::string board_file_text(const BoardInfo& board);

/// The inverse of board_file_text(). Also accepts the output of `symrig info --json`, a receipt, and the
/// manifest of a board's firmware. fails: bad_format.
Result<BoardInfo> parse_board_file(std::string_view text);

}  // namespace symrig
