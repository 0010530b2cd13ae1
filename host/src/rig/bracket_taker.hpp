// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/camera_ledgers.hpp"
#include "rig/device_set.hpp"
#include "rig/evidence.hpp"
#include "rig/plane_evidence.hpp"
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

/// Schedules the exposures of a run in bit planes.
using PlaneScheduler =
    std::function<Result<PlaneSchedule>(std::span<const WantedExposure> wanted, const PlaneRules& rules)>;

/// Takes brackets until every frame is certain. Shows patterns, runs the board, asks the ledger, repeats
/// doubtful brackets, and recovers lost devices.
class BracketTaker {
 public:
  /// options must outlive this object.
  BracketTaker(std::unique_ptr<DeviceSet> devices, const RigOptions& options);

  /// Opens and configures the devices. A camera with a longer readout than described stamps its frames later.
  Result<void> open();

  /// Takes a bracket for each pattern; exposures[i] belongs to pattern i.
  /// fails: frame_missing (a photograph was in doubt after all retakes; the message describes its frames),
  /// fault (of the board), device errors from which the rig cannot recover.
  Result<std::vector<TakenBracket>> take(std::span<const Pattern> patterns,
                                         std::span<const Exposures> exposures);
  /// The same for a projector with bit planes, with another schedule than plan_planes().
  Result<std::vector<TakenBracket>> take(std::span<const Pattern> patterns,
                                         std::span<const Exposures> exposures, PlaneScheduler planner);

  /// The camera's sequence numbers jump: frames of an earlier run of symrig are between.
  void forget_numbers() { ledgers_.restart(); }

  const Camera& camera() const { return devices_->camera(); }
  const Projector& projector() const { return devices_->projector(); }
  /// The camera's timing, with what the projector's bit planes allow.
  Result<CameraTiming> timing() const;
  /// What the projector's planes and the camera allow.
  PlaneRules plane_rules() const;
  const RigTrouble& trouble() const { return trouble_; }
  /// Each warning once: planes are checked again whenever the projector was opened again.
  void warn(std::string what) {
    auto& all = trouble_.warnings;
    if (std::ranges::find(all, what) == all.end()) all.push_back(std::move(what));
  }
  void doubt_exposures(std::string how) { trouble_.exposures = std::move(how); }
  std::int64_t frames() const { return frames_; }      ///< exposures that the camera made
  double rig_seconds() const { return rig_seconds_; }  ///< run time of the board's programs
  RigTime time() const { return time_; }

 private:
  using Brackets = std::vector<std::optional<TakenBracket>>;

  Result<void> attempt(std::span<const Pattern> patterns, std::span<const Exposures> exposures,
                       Brackets& brackets);
  Result<void> attempt_triggered(std::span<const Pattern> patterns, std::span<const std::size_t> pending,
                                 std::span<const Exposures> exposures, Brackets& brackets);
  Result<void> attempt_shown(std::span<const Pattern> patterns, std::span<const std::size_t> pending,
                             std::span<const Exposures> exposures, Brackets& brackets);
  Result<void> attempt_planes(std::span<const Pattern> patterns, std::span<const std::size_t> pending,
                              std::span<const Exposures> exposures, Brackets& brackets);
  Result<void> take_planes(std::span<const Pattern> patterns, std::span<const WantedExposure> wanted);
  Result<std::vector<bool>> proved(const Receipt& receipt, const PlaneSchedule& schedule,
                                   const BoardEvidence& evidence);
  Result<Receipt> run_with_pictures(const PlaneSchedule& schedule, Nanoseconds most);
  Result<SteadyTime> play_pictures(const PlaneSchedule& schedule);
  void judge_pictures(const PlaneSchedule& schedule);
  std::size_t exposures_in_one_program() const;
  RigSetup plane_setup() const;
  /// Stores a bracket. Without one, counts a retake.
  void keep(std::optional<TakenBracket>& bracket, std::optional<TakenBracket> taken);
  Result<bool> show(std::size_t index);
  Result<void> lock(Nanoseconds exposure);
  Result<Brackets> run(const RigSetup& setup, std::span<const Exposures> exposures);
  /// schedule: also demands proof of the planes; nullptr: the projector shows whole pictures.
  Result<Brackets> run(const CompiledProgram& program, std::span<const Exposures> exposures,
                       const PlaneSchedule* schedule);
  Result<Receipt> run_board(const CompiledProgram& compiled, const PlaneSchedule* schedule);
  Result<void> arm(const CompiledProgram& compiled);
  Result<Receipt> start(std::optional<SteadyTime> at, Nanoseconds most);
  Result<void> start_at(SteadyTime at);
  Result<Receipt> wait_for_end(Nanoseconds most);
  Result<void> drain();
  Result<std::vector<CameraFrame>> frames_of(std::size_t count);
  void split_time(const BoardEvidence& evidence, double run_seconds);
  JudgedFrames identify(std::span<const SeenExposure> exposures, std::vector<CameraFrame> frames);
  bool began_after_pattern(const BoardEvidence& evidence) const;
  Result<void> recover(const Error& error);
  Error give_up(int tries) const;
  ExposureLine exposure_line() const;
  RigSetup paced_setup() const;

  std::unique_ptr<DeviceSet> devices_;
  const RigOptions& options_;
  CameraLedgers ledgers_;
  RigTrouble trouble_;
  FrameCounts last_;  // of the newest run that left a bracket in doubt
  std::string last_trouble_;
  std::int64_t last_unanswered_ = 0;
  std::optional<PlaneProof> last_planes_;  // why an exposure of the newest run is in doubt
  std::optional<Shown> shown_;             // Pacing::host: the pattern on the screen
  /// Bit planes: the frames of this take() by photograph and exposure.
  std::vector<std::vector<std::optional<TakenBracket>>> parts_;
  int hold_ = 1;                      // refreshes from picture to picture that the screen can keep
  int lead_ = 1;                      // refreshes for which the first picture of a run waits for the board
  std::vector<ShownPicture> played_;  // of the newest run
  PlaneScheduler planner_ = plan_planes;
  bool loaded_ = false;  // the projector has loaded the patterns of this take()
  std::int64_t frames_ = 0;
  double rig_seconds_ = 0;
  RigTime time_;
};

}  // namespace symrig
