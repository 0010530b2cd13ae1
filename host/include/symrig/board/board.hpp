// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/clock_model.hpp"
#include "symrig/board/link.hpp"
#include "symrig/board/program.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace symrig {

/// The supervisor's states. Values are those of the wire.
enum class BoardState : std::uint8_t {
  boot = 0,
  safe = 1,
  configured = 2,
  loaded = 3,
  armed = 4,
  running = 5,
  done = 6,
  fault = 7
};
std::string_view name(BoardState state);

/// Why the board started. Values are those of the wire.
enum class ResetCause : std::uint8_t { power = 0, pin = 1, watchdog = 2, request = 3 };
std::string_view name(ResetCause cause);

/// The worst use that a committed program makes of an output.
struct LineUse {
  Ticks worst_on;         ///< longest time away from the safe level
  double worst_duty = 0;  ///< on / (on + the off that follows), in steps of 1/1000, rounded up
};

struct BoardStatus {
  BoardState state = BoardState::boot;
  std::uint32_t config_hash = 0;   ///< 0 = not configured
  std::uint32_t program_hash = 0;  ///< 0 = no program
  Ticks now;
  std::uint32_t levels = 0;  ///< of all lines, bit k = line k
  std::optional<FaultInfo> fault;
  std::uint32_t bad_frames = 0;  ///< frames that the board dropped since power-up
  ResetCause reset_cause = ResetCause::power;
  std::optional<FaultInfo> reset_fault;  ///< the fault before the last reset
  std::uint32_t stored_config = 0;  ///< hash of the configuration in the board's permanent memory; 0 = none
};

/// A processor's registers at a crash.
struct BoardCrash {
  std::uint32_t exception =
      0;  ///< its number; on a Pico: 3 hard fault, 15 the main loop hung, 16 + n interrupt n
  std::uint32_t pc = 0;
  std::uint32_t lr = 0;
  std::uint32_t psr = 0;
  std::uint32_t sp = 0;
  std::array<std::uint32_t, 5> r{};  ///< r0 to r3, r12
};

/// What a board has measured about itself since it started.
struct BoardDiagnostics {
  std::uint32_t longest_round = 0;  ///< ticks; compare with BoardInfo::poll_ticks
  std::uint32_t worst_refill = 0;   ///< ticks per record; compare with BoardInfo::refill_ticks
  std::uint32_t flash_reads = 0;
  std::uint32_t flash_hits = 0;
  std::uint32_t queue_overflows = 0;
  std::uint32_t dma_errors = 0;
  std::uint32_t stack_free = 0;     ///< bytes
  std::uint32_t chip_revision = 0;  ///< 0 = not known
  std::optional<BoardCrash> crash;  ///< before the last start

  /// What breaks a promise of the board, or is a known fault of its chip, one sentence each. Empty: nothing.
  [[nodiscard]] std::vector<std::string> objections(const BoardInfo& info) const;
};

struct BoardOptions {
  Nanoseconds reply_timeout{100'000'000};  ///< the host repeats a request after this long without a reply
  int attempts = 8;  ///< how often the host sends one request before it reports device_lost
  Nanoseconds keep_alive{
      1'000'000'000};  ///< during a run, the board goes safe after this long without a message from the host
};

/// One session with the trigger board at the other end of a Link. Not thread-safe. Every call survives lost,
/// repeated and damaged bytes: the host repeats requests, and the board repeats its answer from memory.
///
/// All calls can fail with: device_lost (no answer), device_refused (the message contains the board's reason
/// and a hint), protocol (the answer does not match the request).
class Board {
 public:
  /// Sends Hello and requests the capabilities. fails: protocol (another major version, unknown required
  /// bits).
  static Result<Board> connect(std::unique_ptr<Link> link, const BoardOptions& options = {});
  Board(Board&&) noexcept;
  Board& operator=(Board&&) noexcept;
  ~Board();

  const BoardInfo& info() const;

  /// Sends the configuration of the lines; lines that are not named get the defaults. The board drops its
  /// program. fails: unknown_name, bad_argument.
  Result<void> configure(std::span<const LineConfig> lines);
  /// Sends a program and commits it by CRC. Does nothing if the board already holds the program and has this
  /// configuration.
  Result<void> upload(const Program& program);
  Result<void> arm();
  /// Arms a run that continues without a host. fails: device_refused (the board has a lamp or laser line).
  Result<void> arm_autonomous();
  /// Starts now.
  Result<void> start();
  /// Starts when the board's clock reads `tick`.
  Result<void> start_at(Ticks tick);
  /// Waits for the end of the run and sends keep-alives meanwhile. A run that ends by time-out, abort or
  /// fault is not an error of wait(): the receipt contains how it ended. fails: timeout (the run continues).
  Result<Receipt> wait(Nanoseconds timeout);
  /// The receipt of the last run as far as it has arrived; its end is `lost` until the run has ended.
  Receipt so_far() const;
  /// upload, arm, start, wait.
  Result<Receipt> run(const Program& program, Nanoseconds timeout);

  /// Puts the outputs to their safe levels at once, in any state. This request overtakes all others.
  Result<void> abort();
  /// Leaves FAULT for SAFE. The board must be configured again.
  Result<void> clear_fault();
  Result<BoardStatus> status();
  /// No value: the board measures nothing about itself.
  Result<std::optional<BoardDiagnostics>> diagnostics();
  /// The board goes safe after `ttl` without a keep-alive; 0 turns this off. wait() repeats the keep-alive.
  Result<void> keep_alive(Nanoseconds ttl);
  Result<TimeReading> time();
  /// When the link was opened: `opened() + HostTime::since` is the same moment on this machine's clock.
  SteadyTime opened() const;
  /// Receives messages of the board for `duration`; a board in virtual time runs meanwhile. Sends no
  /// keep-alive.
  Result<void> idle(Nanoseconds duration);
  /// The worst use that the board's program makes of an output. fails: unknown_name.
  Result<LineUse> line_use(std::string_view line);
  /// The board reads its program again and compares its hash with the committed one.
  Result<void> verify_program();

  /// Sets an output by hand while no program runs. Limits, interlock and keep-alive apply as in a run.
  /// fails: unknown_name.
  Result<void> set_line(std::string_view line, bool level);
  /// The board's light blinks fast for `duration` (at most 60 s; 0 = stop).
  Result<void> identify(Nanoseconds duration);
  /// Stores the present configuration in the board's permanent memory: its safe levels then hold from
  /// power-up on. Also stores a name for the board (at most 23 bytes). fails: bad_argument.
  Result<void> store_config(std::string_view label);
  /// Restarts the board, in its boot loader if `bootloader`. This ends the session.
  Result<void> reboot(bool bootloader);
  /// The board feeds its watchdog no more, until that resets it: a test of the watchdog. Its outputs go to
  /// their safe levels first and stay there. It still answers until the reset, which ends the session.
  Result<void> starve_watchdog();
  /// Begins a new session over the same link, after the board has restarted. fails: as connect();
  /// device_lost also if the link itself ended (USB).
  Result<void> rejoin();

  /// Called for each mark as it arrives during wait(). Empty: none.
  void on_mark(std::function<void(const StepMark&)> callback);

 private:
  class Session;
  explicit Board(std::unique_ptr<Session> session);
  std::unique_ptr<Session> session_;
};

}  // namespace symrig
