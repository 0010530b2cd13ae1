// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/board_info.hpp"
#include "symrig/board/clock_model.hpp"
#include "symrig/board/link.hpp"
#include "symrig/board/program.hpp"
#include "symrig/board/receipt.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

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

/// How a committed program uses an output at worst.
struct LineUse {
  Ticks worst_on;  ///< longest time away from the safe level
  double worst_duty =
      0;  ///< share of a pulse in the pulse and the rest after it, steps of 1/1000, rounded up
};

struct BoardStatus {
  BoardState state = BoardState::boot;
  std::uint32_t config_hash = 0;   ///< 0 = not configured
  std::uint32_t program_hash = 0;  ///< 0 = no program
  Ticks now;
  std::uint32_t levels = 0;  ///< of all lines, bit k = line k
  std::optional<FaultInfo> fault;
  std::uint32_t bad_frames = 0;  ///< frames the board threw away since power-up
  ResetCause reset_cause = ResetCause::power;
  std::optional<FaultInfo> reset_fault;  ///< kept over the last reset
  std::uint32_t stored_config = 0;       ///< hash of the configuration kept over power-off; 0 = none
};

struct BoardOptions {
  Nanoseconds reply_timeout{100'000'000};  ///< before a request is sent again
  int attempts = 8;                        ///< sends of one request before the board counts as lost
  Nanoseconds keep_alive{
      1'000'000'000};  ///< the board goes safe if it hears nothing for that long during a run
};

/// A trigger board at the other end of a Link: one session. Not thread-safe. Every call survives lost,
/// repeated and damaged bytes (requests are repeated; the board answers a repeated request from memory).
///
/// fails, all calls: device_lost (no answer), device_refused (the board's reason and its hint are in the
/// text), protocol (an answer that makes no sense).
class Board {
 public:
  /// Says hello and asks for the capabilities. fails: protocol (another major version, unknown required
  /// bits).
  static Result<Board> connect(std::unique_ptr<Link> link, const BoardOptions& options = {});
  Board(Board&&) noexcept;
  Board& operator=(Board&&) noexcept;
  ~Board();

  const BoardInfo& info() const;

  /// Tells the board its lines; outputs not named get the defaults. Drops a program. fails: unknown_name,
  /// bad_argument.
  Result<void> configure(std::span<const LineConfig> lines);
  /// Sends a program and commits it by CRC; does nothing if the board already holds it under this
  /// configuration.
  Result<void> upload(const Program& program);
  Result<void> arm();
  /// The same for a run that goes on without a host. fails: device_refused with a lamp or laser line.
  Result<void> arm_autonomous();
  /// Starts now.
  Result<void> start();
  /// Starts when the board's clock reads `tick`.
  Result<void> start_at(Ticks tick);
  /// Waits for the end of the run and keeps the board alive meanwhile. A run that ends by time-out, abort or
  /// fault is not an error of wait(): the receipt says so. fails: timeout (the run goes on).
  Result<Receipt> wait(Nanoseconds timeout);
  /// upload, arm, start, wait.
  Result<Receipt> run(const Program& program, Nanoseconds timeout);

  /// Outputs to their safe levels, at once, in any state. Goes before everything else on the wire.
  Result<void> abort();
  /// Leaves FAULT for SAFE. The board must be configured again.
  Result<void> clear_fault();
  Result<BoardStatus> status();
  /// The board goes safe if it hears no keep-alive for `ttl`; 0 = no longer. wait() repeats it by itself.
  Result<void> keep_alive(Nanoseconds ttl);
  Result<TimeReading> time();
  /// When the link was opened: `opened() + HostTime::since` is the same moment on this machine's clock.
  SteadyTime opened() const;
  /// Takes what the board sends for so long, and lets a board in virtual time run. Keeps nothing alive.
  Result<void> idle(Nanoseconds duration);
  /// How the program that the board holds uses an output at worst. fails: unknown_name.
  Result<LineUse> line_use(std::string_view line);
  /// Lets the board read its program again and compare it with what was committed.
  Result<void> verify_program();

  /// Sets an output by hand, while nothing runs. Limits, interlock and keep-alive hold as in a run.
  /// fails: unknown_name.
  Result<void> set_line(std::string_view line, bool level);
  /// The board's light blinks fast for so long (at most 60 s; 0 = stop).
  Result<void> identify(Nanoseconds duration);
  /// Keeps the configuration in force over power-off, so that its safe levels hold from power-up on, and
  /// gives the board a name (at most 23 bytes). fails: bad_argument.
  Result<void> store_config(std::string_view label);
  /// Starts the board anew, in its boot loader if asked for. The session is over afterwards.
  Result<void> reboot(bool bootloader);

  /// Called for each mark as it arrives during wait(). Empty: none.
  void on_mark(std::function<void(const StepMark&)> callback);

 private:
  class Session;
  explicit Board(std::unique_ptr<Session> session);
  std::unique_ptr<Session> session_;
};

}  // namespace symrig
