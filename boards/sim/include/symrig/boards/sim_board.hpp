// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig::board_sim {

class SimBoard;

/// "No event is planned."
inline constexpr std::uint64_t kNever = std::numeric_limits<std::uint64_t>::max();

/// A device on the board's lines: a projector, a camera, a lamp. Uses the board's virtual time.
class Peripheral {
 public:
  Peripheral() = default;
  Peripheral(const Peripheral&) = delete;
  Peripheral& operator=(const Peripheral&) = delete;
  virtual ~Peripheral() = default;

  /// The output word changed at `tick` (= board.now()); bit k of levels is line k. Called only for changes,
  /// and once when the peripheral is attached.
  virtual void outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) = 0;
  /// Tick of the peripheral's next event (never before board.now()), or kNever.
  virtual std::uint64_t next_event() const = 0;
  /// Called when board.now() == next_event(). Must advance next_event(), else the board would stop.
  virtual void on_event(std::uint64_t tick, SimBoard& board) = 0;
};

/// One GPIO line of the board. Its index in SimBoardConfig::lines is its number on the wire.
struct SimLine {
  std::string name;
  bool output = false;
};

/// projector_trigger, camera_trigger, lamp_enable (outputs 0..2), vsync, camera_strobe, interlock (inputs 3,
/// 4, 5).
std::vector<SimLine> default_sim_lines();

struct SimBoardConfig {
  std::vector<SimLine> lines = default_sim_lines();  ///< at most 32; outputs among the first 28
  std::uint64_t tick_hz = 125'000'000;               ///< ticks per second of virtual time (8 ns each)
  std::uint64_t start_tick = 0;                      ///< clock at power-up
  std::uint32_t program_records = 24'576;            ///< space for programs, 8 bytes per record
  std::uint32_t min_dwell = 5;                       ///< shortest hold of a word, ticks
  std::uint32_t wait_latency = 125;     ///< ticks from an awaited edge (or its time-out) to the next word
  std::uint32_t engine_segments = 256;  ///< depth of the edge engine's queue
  // The firmware takes no virtual time. A board with refill_ticks > 0 refuses programs that it could not keep
  // up with.
  std::uint32_t refill_ticks = 0;  ///< to refill one record
  std::uint32_t poll_ticks = 0;    ///< before refilling begins
};

/// The watchdog resets a board whose firmware has not run for this long, in milliseconds.
inline constexpr std::uint32_t kSimWatchdogMs = 400;

/// The firmware core on a board in virtual time, in the same process. Its link carries only bytes. Time
/// advances only in advance() and advance_to(). Nothing depends on the wall clock, so every run is
/// repeatable.
class SimBoard {
 public:
  explicit SimBoard(SimBoardConfig config = {});
  SimBoard(const SimBoard&) = delete;
  SimBoard& operator=(const SimBoard&) = delete;
  ~SimBoard();

  /// The board does not own the peripheral, which must outlive it. Peripherals are called in order of
  /// attachment.
  void attach(Peripheral& peripheral);

  const SimBoardConfig& config() const;
  std::uint64_t now() const;
  /// Index of the named line, -1 if there is none.
  int line(std::string_view name) const;
  /// Present levels of all lines, bit k = line k. Peripherals drive the inputs.
  std::uint32_t levels() const;
  /// Sets an input line at now(). Ignores outputs and unknown lines.
  void set_input(int line, bool level);

  /// Bytes from the host. The firmware handles them at once, at now().
  void write(std::span<const std::uint8_t> bytes);
  /// The bytes that the firmware has sent to the host since the last call; may be empty.
  std::vector<std::uint8_t> read();

  /// Tick of the next event without input from the host, or kNever.
  std::uint64_t next_event() const;
  /// Runs to the next event. false: no event is planned, and time did not advance.
  bool advance();
  /// Runs every event up to `tick` and stops there. Does nothing if `tick` is in the past.
  void advance_to(std::uint64_t tick);

  // For tests to look at.

  /// State of the firmware's supervisor, numbered as on the wire (0 BOOT ... 7 FAULT).
  int supervisor_state() const;
  /// The levels that the firmware now uses as safe levels.
  std::uint32_t safe_levels() const;
  /// The state LED, as last set.
  bool light() const;
  /// The board is in its boot loader, and stays there until reboot().
  bool in_bootloader() const;

  // Faults for tests.

  /// Stops the firmware until `tick`, like a stuck main loop. Hardware continues. The watchdog resets the
  /// board after kSimWatchdogMs.
  void stall_firmware_until(std::uint64_t tick);
  /// Power cycle: the clock continues and the firmware restarts. The fault record and stored settings
  /// survive.
  void reboot();
  /// Connects or disconnects the host's end of the link.
  void set_attached(bool attached);
  /// The settings memory refuses all writes, like worn flash.
  void break_settings();
  /// Gives a word directly to the edge engine, as broken validation in the firmware would.
  void force_segment(std::uint32_t levels, std::uint32_t ticks);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace symrig::board_sim
