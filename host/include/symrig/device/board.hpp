// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/device/board_info.hpp"
#include "symrig/device/clock_model.hpp"
#include "symrig/device/link.hpp"
#include "symrig/device/program.hpp"
#include "symrig/device/receipt.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace symrig::device {

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

struct BoardStatus {
  BoardState state = BoardState::boot;
  std::uint32_t config_hash = 0;   ///< 0 = not configured
  std::uint32_t program_hash = 0;  ///< 0 = no program
  Ticks now;
  std::uint32_t levels = 0;  ///< of all lines, bit k = line k
  std::optional<FaultInfo> fault;
  std::uint32_t bad_frames = 0;  ///< frames the board threw away since power-up
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

  /// Called for each mark as it arrives during wait(). Empty: none.
  void on_mark(std::function<void(const StepMark&)> callback);

 private:
  class Session;
  explicit Board(std::unique_ptr<Session> session);
  std::unique_ptr<Session> session_;
};

}  // namespace symrig::device
