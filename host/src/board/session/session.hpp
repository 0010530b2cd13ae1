// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "board/links/wire.hpp"
#include "symrig/board/board.hpp"
#include "symrig/board/program.hpp"
#include "symrig/protocol/line_config.hpp"
#include "symrig/protocol/messages.hpp"

#include <functional>
#include <memory>
#include <optional>
#include <string_view>

namespace symrig::board {

/// Collects a run's events in its receipt.
class RunLog {
 public:
  std::function<void(const StepMark&)> on_mark;

  /// Begins the log of a run. `blank` contains the values that are known before the run.
  void open(const Receipt& blank);
  void take(const symrig_wire_Event& event);

  bool finished() const { return finished_; }
  const Receipt& receipt() const { return receipt_; }

 private:
  void take_done(const symrig_wire_RunDone& done);

  Receipt receipt_;
  bool started_ = false;
  bool finished_ = false;
};

/// Converts a fault of the wire; adds its name and hint.
FaultInfo to_fault(const symrig_wire_Fault& fault);

}  // namespace symrig::board

namespace symrig {

/// The state of a Board's session.
class Board::Session {
 public:
  Session(std::unique_ptr<Link> link, const BoardOptions& options);

  Result<void> introduce();
  Result<void> configure(std::span<const LineConfig> lines);
  Result<void> upload(const Program& program);
  Result<void> arm(bool autonomous);
  Result<void> start(std::optional<Ticks> at);
  Result<Receipt> wait(Nanoseconds timeout);
  const Receipt& so_far() const { return log_.receipt(); }
  Result<void> abort();
  Result<void> clear_fault();
  Result<BoardStatus> status();
  Result<std::optional<BoardDiagnostics>> diagnostics();
  Result<void> keep_alive(Nanoseconds ttl);
  Result<TimeReading> time();
  SteadyTime opened() const { return wire_.opened(); }
  Result<void> idle(Nanoseconds duration);
  Result<LineUse> line_use(std::string_view line);
  Result<void> verify_program();
  Result<void> set_line(std::string_view line, bool level);
  Result<void> identify(Nanoseconds duration);
  Result<void> store_config(std::string_view label);
  Result<void> reboot(bool bootloader);
  Result<void> starve_watchdog();

  const BoardInfo& info() const { return info_; }
  board::RunLog& log() { return log_; }

 private:
  /// The reply if its code is OK, otherwise its error. name: for the message.
  Result<symrig_wire_Reply> ask(const symrig_wire_Request& request, std::string_view name);
  Result<void> learn_identity();
  Result<void> learn_capabilities();
  Result<void> learn_line(std::uint32_t line);
  Result<bool> holds(const Program& program);
  Result<void> commit(std::uint32_t program_id, std::uint32_t hash);
  Result<void> stay_alive();
  /// Number of a line of that name and direction. fails: unknown_name.
  Result<std::uint32_t> find_line(std::string_view line, bool output) const;

  BoardOptions options_;
  BoardInfo info_;
  std::uint32_t reboot_token_ = 0;  // CRC-32C of the board's unique id
  board::RunLog log_;
  board::Wire wire_;

  std::uint32_t config_hash_ = 0;
  std::uint32_t program_hash_ = 0;
  symrig_wire_CommitReply committed_ = symrig_wire_CommitReply_init_zero;
  bool has_program_ = false;
  std::uint32_t next_program_id_ = 1;
  Nanoseconds ttl_{0};
  Nanoseconds last_alive_{0};
};

}  // namespace symrig
