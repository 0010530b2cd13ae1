// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/boards/sim_board.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace symrig::board_sim {

struct SimProjectorConfig {
  std::string trigger_line = "projector_trigger";
  std::string vsync_line = "vsync";
  std::uint32_t refresh_hz = 60;
  std::uint32_t vsync_pulse_us = 100;
};

/// A projector that draws `refresh_hz` pictures a second. A rising edge on its trigger line requests the next
/// pattern, which appears at the next rising vsync. Two edges in one refresh advance by two patterns.
class SimProjector final : public Peripheral {
 public:
  /// Pattern `index` is on the screen from `tick` to the next change. Nothing is shown before the first
  /// change.
  struct Change {
    std::uint64_t tick;
    std::int64_t index;
  };

  explicit SimProjector(const SimBoard& board, const SimProjectorConfig& config = {});

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) override;
  std::uint64_t next_event() const override;
  void on_event(std::uint64_t tick, SimBoard& board) override;

  /// All pattern changes so far, in order. index counts from 0.
  const std::vector<Change>& changes() const { return changes_; }
  /// The pattern on the screen at `tick`, -1 before the first advance.
  std::int64_t pattern_at(std::uint64_t tick) const;
  /// Shows pattern `index` for a host: runs the board to the next refresh, at which the pattern appears.
  void show(std::int64_t index, SimBoard& board);
  /// Number of refreshes so far.
  std::uint64_t refreshes() const { return refreshes_; }
  /// Starts counting again, with nothing on the screen.
  void reset();

 private:
  std::uint64_t refresh_tick(std::uint64_t number) const;

  int trigger_;
  int vsync_;
  std::uint64_t tick_hz_;
  std::uint64_t origin_;
  std::uint64_t refresh_hz_;
  std::uint64_t pulse_;
  std::uint64_t refreshes_ = 0;
  std::uint32_t levels_ = 0;
  bool vsync_high_ = false;
  std::int64_t shown_ = -1;
  std::int64_t asked_ = 0;
  std::vector<Change> changes_;
};

struct SimCameraConfig {
  std::string trigger_line = "camera_trigger";
  std::string strobe_line = "camera_strobe";
  std::uint64_t readout_us = 3'000;  ///< busy time after each exposure
};

/// A camera in trigger-width mode: it exposes while its trigger line is high, and its strobe line follows. It
/// misses a rising trigger while it reads out the previous frame, as real cameras do.
class SimCamera final : public Peripheral {
 public:
  /// One frame, exposed during [begin, end) in board ticks.
  struct Frame {
    std::uint64_t begin;
    std::uint64_t end;
  };

  explicit SimCamera(const SimBoard& board, const SimCameraConfig& config = {});

  void outputs_changed(std::uint64_t tick, std::uint32_t levels, SimBoard& board) override;
  std::uint64_t next_event() const override { return kNever; }
  void on_event(std::uint64_t tick, SimBoard& board) override;

  /// Finished frames so far, in order.
  const std::vector<Frame>& frames() const { return frames_; }
  std::int64_t missed_triggers() const { return missed_; }
  void reset();

 private:
  int trigger_;
  int strobe_;
  std::uint64_t readout_;
  bool exposing_ = false;
  bool high_ = false;
  std::uint64_t begin_ = 0;
  std::uint64_t busy_until_ = 0;
  std::int64_t missed_ = 0;
  std::vector<Frame> frames_;
};

}  // namespace symrig::board_sim
