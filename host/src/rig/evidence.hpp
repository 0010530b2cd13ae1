// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/board.hpp"
#include "symrig/board/clock_model.hpp"
#include "symrig/board/program.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/rig/camera_ledger.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// A moment of the board on this computer's clock: |at - truth| <= bound.
struct SteadyMoment {
  SteadyTime at;
  Nanoseconds bound{0};
};

/// Converts the board's clock to CLOCK_MONOTONIC, which stamps frames and refreshes. ClockModel is good for
/// the last 32 seconds. A run of the board may last many minutes, and its edges are known only at its end. So
/// this class keeps the models of the last hour.
class SteadyClock {
 public:
  /// Discards all readings, and reads the board's clock several times. A bound is then available at once.
  Result<void> begin(Board& board);
  /// Adds a reading.
  /// fails: device_lost (the board was restarted: its clock went back or left the limits of ClockModel), and
  /// as Board::time().
  Result<void> ask(Board& board);
  /// fails: bad_argument before begin(), limit.
  Result<SteadyMoment> at(Ticks ticks) const;
  /// The board's clock at a moment that is not long ago, or soon.
  /// fails: as at().
  Result<Ticks> ticks_at(SteadyTime time) const;

 private:
  /// The model after a reading.
  struct Past {
    BoardTime taken;
    HostTime received;
    ClockModel model;
  };

  void keep(const TimeReading& reading);
  const ClockModel& model_for(BoardTime moment) const;

  std::optional<ClockModel> model_;
  std::deque<Past> past_;  // newest last
  SteadyTime opened_;
};

/// The line that shows the camera's exposures.
struct ExposureLine {
  int line = -1;  ///< number on the board
  bool active_low = false;
  Nanoseconds delay{0};   ///< from an edge of the line to what the camera does
  Nanoseconds offset{0};  ///< exposure time minus the time for which the line is active
  /// A pulse belongs to a mark if it begins at most this long after the mark.
  Nanoseconds tolerance{1'000'000};
};

/// A pulse or an exposure on the board's clock.
struct TickPulse {
  Ticks begin, end;
};

/// The exposures of one run, from the board.
struct BoardEvidence {
  std::vector<TickPulse> on_board;      ///< the exposure of every pulse of the line, on the board's clock
  std::vector<SeenExposure> exposures;  ///< the same on the host's clock, requested or not
  std::vector<Nanoseconds> widths;      ///< the exposure time of each pulse
  /// [first[i] + j]: the pulse of exposure j of photograph i. None: the camera made no exposure.
  std::vector<std::optional<std::size_t>> pulse_of;
  std::int64_t unanswered = 0;  ///< exposures without a pulse
  std::int64_t unasked = 0;     ///< pulses without an exposure in the program
};

/// Reads a receipt: assigns the pulses of the exposure line to marks by time, on the host's clock. A pulse
/// that begins or ends outside the run does not count.
/// first: index of the first exposure of each photograph, and the end of the last one.
/// fails: bad_argument (marks out of order), and as SteadyClock::at().
Result<BoardEvidence> board_evidence(const Receipt& receipt, const ExposureLine& line,
                                     std::span<const std::size_t> first, const SteadyClock& clock);

/// The camera's facts about a frame, with a hash of its content.
SeenFrame camera_evidence(const CameraFrame& frame, const NoiseModel& noise);

/// What the ledgers say of the frames of one run.
struct JudgedFrames {
  /// For each exposure: the frame that certainly shows it. Of several cameras: join_frames() of their frames,
  /// none if one of them has none.
  std::vector<std::optional<CameraFrame>> frame;
  FrameCounts counts;   ///< of all cameras
  std::string trouble;  ///< "1 missing, 2 late". Of several cameras: "pair 2: 1 missing"
};

/// One ledger for each camera of a rig. They share the trigger, and so the exposures that the board saw.
class CameraLedgers {
 public:
  CameraLedgers(const LedgerOptions& options, std::size_t cameras)
      : ledgers_(cameras, CameraLedger(options)) {}

  /// As CameraLedger::judge. frames: of all cameras, those of each camera in order of arrival.
  JudgedFrames judge(std::span<const SeenExposure> exposures, std::vector<CameraFrame> frames,
                     const Camera& camera);

  // As those of CameraLedger, for all cameras.
  void restart();
  void doubt();
  bool needs_guards() const;
  int guards_needed() const;

 private:
  std::vector<CameraLedger> ledgers_;
};

}  // namespace symrig
