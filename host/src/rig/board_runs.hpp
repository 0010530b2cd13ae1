// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/device_set.hpp"
#include "rig/evidence.hpp"
#include "rig/planes.hpp"
#include "symrig/program/compile.hpp"
#include "symrig/rig/rig.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig {

/// The frames of one photograph, all certain, with the exposure times that the board measured.
struct TakenBracket {
  std::vector<CameraFrame> frames;
  std::vector<Nanoseconds> exposures;
};

/// Of several photographs; none: it is not taken.
using TakenBrackets = std::vector<std::optional<TakenBracket>>;

/// What the edges of a run say of its exposures in bit planes.
struct RunProof {
  std::vector<bool> proved;         ///< of each bracket
  std::int64_t doubtful = 0;        ///< exposures that were made in another plane, or may have been
  std::optional<PlaneProof> doubt;  ///< why one of them is doubtful
};

/// Pictures that the projector shows while the board runs.
struct RunPictures {
  /// Shows them, starts the armed board, and waits for its end. most: the longest run time.
  std::function<Result<Receipt>(Nanoseconds most)> show;
  std::function<Result<RunProof>(const Receipt& receipt, const BoardEvidence& evidence)> prove;
};

/// Runs programs of exposures on the board, and keeps the frames that are certain. Asks the ledger, counts
/// what went wrong, and recovers lost devices.
class BoardRuns {
 public:
  /// options must outlive this object.
  BoardRuns(std::unique_ptr<DeviceSet> devices, const RigOptions& options);

  /// Opens and configures the devices. A camera with a longer readout than described stamps its frames later.
  Result<void> open();

  /// Takes guard frames until the ledger is locked.
  Result<void> lock(Nanoseconds exposure);
  /// Runs the board once. Returns the brackets that are certain.
  Result<TakenBrackets> run(const RigSetup& setup, std::span<const Exposures> exposures);
  /// The same with a program. pictures: also demands proof of the planes; nullptr: the projector shows whole
  /// pictures.
  Result<TakenBrackets> run(const CompiledProgram& program, std::span<const Exposures> exposures,
                            const RunPictures* pictures);
  /// Starts the armed board with `begin`, and waits for its end.
  Result<Receipt> play(const std::function<Result<void>()>& begin, Nanoseconds most);

  /// Opens the device again that failed last. Returns which one it was.
  Result<DeviceSet::Part> recover(const Error& error);
  /// The error of a photograph that was in doubt after all tries.
  Error give_up(int tries) const;

  /// Stores a bracket. Without one, counts a retake.
  void keep(std::optional<TakenBracket>& bracket, std::optional<TakenBracket> taken);
  /// The screen shows another pattern. Exposures before that are in doubt. Returns false if its refresh count
  /// or clock did not advance. Then it is unknown what it shows.
  bool showed(const Shown& shown);
  /// The camera's sequence numbers jump: frames of an earlier run of symrig are between.
  void forget_numbers() { ledgers_.restart(); }

  DeviceSet& devices() { return *devices_; }
  const DeviceSet& devices() const { return *devices_; }
  const RigOptions& options() const { return options_; }
  RigTrouble& trouble() { return trouble_; }
  const RigTrouble& trouble() const { return trouble_; }
  std::int64_t frames() const { return frames_; }      ///< exposures that the camera made
  double rig_seconds() const { return rig_seconds_; }  ///< run time of the board's programs
  RigTime time() const { return time_; }

 private:
  Result<Receipt> run_board(const CompiledProgram& compiled, const RunPictures* pictures);
  Result<void> arm(const CompiledProgram& compiled);
  Result<Receipt> wait_for_end(Nanoseconds most);
  Result<void> drain();
  Result<std::vector<CameraFrame>> frames_of(std::size_t count);
  void split_time(const BoardEvidence& evidence, double run_seconds);
  JudgedFrames identify(std::span<const SeenExposure> exposures, std::vector<CameraFrame> frames);
  bool began_after_pattern(const BoardEvidence& evidence) const;
  ExposureLine exposure_line() const;

  std::unique_ptr<DeviceSet> devices_;
  const RigOptions& options_;
  CameraLedgers ledgers_;
  RigTrouble trouble_;
  FrameCounts last_;  // of the newest run that left a bracket in doubt
  std::string last_trouble_;
  std::int64_t last_unanswered_ = 0;
  std::optional<PlaneProof> last_planes_;  // why an exposure of the newest run is in doubt
  std::optional<Shown> shown_;             // Pacing::host: the pattern on the screen
  std::int64_t frames_ = 0;
  double rig_seconds_ = 0;
  RigTime time_;
};

}  // namespace symrig
