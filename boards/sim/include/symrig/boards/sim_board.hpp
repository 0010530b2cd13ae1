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

/// Something wired to the board's lines: a projector, a camera, a lamp. Lives in the board's virtual time.
class Peripheral {
 public:
  Peripheral() = default;
  Peripheral(const Peripheral&) = delete;
  Peripheral& operator=(const Peripheral&) = delete;
  virtual ~Peripheral() = default;

  /// The output word changed at `tick` (= board.now()); bit k of levels is line k. Called on changes only,
  /// and once when the peripheral is attached.
  virtual void outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) = 0;
  /// Tick of the next event of its own (never before board.now()), or kNever.
  virtual std::uint64_t next_event() const = 0;
  /// Called when board.now() == next_event(). Must move next_event() on, or the board would stand still.
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
  std::uint32_t program_records = 24'576;            ///< room for programs, 8 bytes a record
  std::uint32_t min_dwell = 5;                       ///< shortest hold of a word, ticks
  std::uint32_t wait_latency = 125;     ///< ticks from an awaited edge (or its time-out) to the next word
  std::uint32_t engine_segments = 256;  ///< depth of the edge engine's queue
  // The firmware takes no virtual time. A board that says it does (refill_ticks > 0) refuses what it could
  // not keep up with.
  std::uint32_t refill_ticks = 0;  ///< to refill one record
  std::uint32_t poll_ticks = 0;    ///< before refilling begins
};

/// The watchdog resets a board whose firmware has not run for so long, in thousandths of a second.
inline constexpr std::uint32_t kSimWatchdogMs = 400;

/// The firmware core on a board in virtual time, linked in process and speaking only bytes. Time stands still
/// except inside advance(): nothing here depends on the wall clock, so that every run is repeatable.
class SimBoard {
 public:
  explicit SimBoard(SimBoardConfig config = {});
  SimBoard(const SimBoard&) = delete;
  SimBoard& operator=(const SimBoard&) = delete;
  ~SimBoard();

  /// The peripheral must outlive the board (it is not owned). Peripherals are served in order of attachment.
  void attach(Peripheral& peripheral);

  const SimBoardConfig& config() const;
  std::uint64_t now() const;
  /// Index of the line of that name, -1 if there is none.
  int line(std::string_view name) const;
  /// Levels of all lines now, bit k = line k (inputs as peripherals drive them).
  std::uint32_t levels() const;
  /// Drives an input line from outside, at now(). Ignored on outputs and unknown lines.
  void set_input(int line, bool level);

  /// Bytes from the host. The firmware takes them at once, at now().
  void write(std::span<const std::uint8_t> bytes);
  /// Bytes to the host that the firmware has sent so far (may be empty).
  std::vector<std::uint8_t> read();

  /// Tick of the next thing that happens without a word from the host, or kNever.
  std::uint64_t next_event() const;
  /// Runs to the next event. false: nothing is planned, time did not move.
  bool advance();
  /// Runs every event up to `tick` and stops there. Does nothing if tick is in the past.
  void advance_to(std::uint64_t tick);

  // What tests look at.

  /// State of the firmware's supervisor, numbered as on the wire (0 BOOT ... 7 FAULT).
  int supervisor_state() const;
  /// Levels that the firmware takes for safe at present.
  std::uint32_t safe_levels() const;
  /// The light that shows the state, as last set.
  bool light() const;
  /// The board has gone to its boot loader (and stays there until reboot()).
  bool in_bootloader() const;

  // What tests break on purpose.

  /// The firmware is not given the processor until `tick` (a stuck main loop); hardware goes on. The watchdog
  /// resets it after kSimWatchdogMs.
  void stall_firmware_until(std::uint64_t tick);
  /// Power cycle: the clock goes on, the firmware starts anew; the fault record and stored settings survive.
  void reboot();
  /// The host end of the link is (not) there.
  void set_attached(bool attached);
  /// The memory for settings takes nothing any more (a worn flash).
  void break_settings();
  /// Feeds a word straight to the edge engine behind the firmware's back, as broken validation would.
  void force_segment(std::uint32_t levels, std::uint32_t ticks);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace symrig::board_sim
