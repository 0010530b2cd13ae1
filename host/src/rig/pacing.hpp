// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "rig/board_runs.hpp"
#include "rig/planes.hpp"
#include "symrig/base/result.hpp"

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace symrig {

/// The photographs that are to be taken; exposures[i] belongs to pattern i.
struct WantedPhotographs {
  std::span<const Pattern> patterns;
  std::span<const Exposures> exposures;
};

/// How patterns and exposures come together. BracketTaker calls attempt() until all photographs are there.
class PatternPacing {
 public:
  PatternPacing() = default;
  PatternPacing(const PatternPacing&) = delete;
  PatternPacing& operator=(const PatternPacing&) = delete;
  virtual ~PatternPacing() = default;

  /// Before the first attempt at these photographs.
  virtual void begin(const WantedPhotographs& /*all*/) {}
  /// The projector was opened again, and has loaded nothing.
  virtual void projector_reopened() {}
  /// Takes the pending photographs once, and stores the certain ones. all: as in begin().
  virtual Result<void> attempt(const WantedPhotographs& all, std::span<const std::size_t> pending,
                               TakenBrackets& brackets) = 0;
};

/// All patterns in one run of the board: the projector advances at each trigger.
class TriggeredPacing final : public PatternPacing {
 public:
  /// runs must outlive this object, as for the others.
  explicit TriggeredPacing(BoardRuns& runs) : runs_(runs) {}
  Result<void> attempt(const WantedPhotographs& all, std::span<const std::size_t> pending,
                       TakenBrackets& brackets) override;

 private:
  BoardRuns& runs_;
};

/// One pattern after the other: each is on the screen before the board runs its bracket.
class ShownPacing final : public PatternPacing {
 public:
  explicit ShownPacing(BoardRuns& runs) : runs_(runs) {}
  void begin(const WantedPhotographs& /*all*/) override { loaded_ = false; }
  void projector_reopened() override { loaded_ = false; }
  Result<void> attempt(const WantedPhotographs& all, std::span<const std::size_t> pending,
                       TakenBrackets& brackets) override;

 private:
  BoardRuns& runs_;
  bool loaded_ = false;  // the projector has loaded the patterns
};

/// Schedules the exposures of a run in bit planes.
using PlaneScheduler =
    std::function<Result<PlaneSchedule>(std::span<const WantedExposure> wanted, const PlaneRules& rules)>;

/// All exposures in bit planes of pictures that change while the board runs.
class PlanePacing final : public PatternPacing {
 public:
  explicit PlanePacing(BoardRuns& runs) : runs_(runs) {}
  void begin(const WantedPhotographs& all) override;
  /// As many exposures in a run as the board's memory holds. A frame that is certain stays: only the others
  /// are taken again.
  Result<void> attempt(const WantedPhotographs& all, std::span<const std::size_t> pending,
                       TakenBrackets& brackets) override;

  /// What the projector's planes and the camera allow.
  PlaneRules rules() const;
  void set_scheduler(PlaneScheduler schedule) { schedule_ = std::move(schedule); }

 private:
  Result<void> take(std::span<const Pattern> patterns, std::span<const WantedExposure> wanted);
  std::size_t exposures_in_one_program() const;
  RigSetup setup() const;
  Result<Receipt> run_with_pictures(const PlaneSchedule& schedule, Nanoseconds most);
  Result<SteadyTime> play_pictures(const PlaneSchedule& schedule);
  Result<void> start_at(SteadyTime at);
  void judge_pictures(const PlaneSchedule& schedule);
  Result<RunProof> prove(const Receipt& receipt, const PlaneSchedule& schedule,
                         const BoardEvidence& evidence) const;

  BoardRuns& runs_;
  PlaneScheduler schedule_ = plan_planes;
  /// The frames by photograph and exposure.
  std::vector<TakenBrackets> parts_;
  int hold_ = 1;                      // refreshes from picture to picture that the screen can keep
  int lead_ = 1;                      // refreshes for which the first picture of a run waits for the board
  std::vector<ShownPicture> played_;  // of the newest run
};

}  // namespace symrig
