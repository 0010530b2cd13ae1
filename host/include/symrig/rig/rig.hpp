// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/board.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/rig/camera_ledger.hpp"
#include "symrig/rig/devices.hpp"
#include "symrig/rig/frame_reading.hpp"

#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// How a Rig takes its photographs.
struct RigOptions {
  /// The lines that are wired, and the timing of projector and camera. Without a strobe line, the camera's
  /// trigger line shows the exposures.
  RigSetup setup = default_rig_setup();
  /// From the end of an exposure to the next trigger; none: the shortest that the camera allows.
  std::optional<Nanoseconds> gap;
  /// A strobe rises at most this long after its mark.
  Nanoseconds strobe_tolerance{1'000'000};
  /// Frames a photograph, shortest first. 0: planned for each photograph by what is expected of it
  /// (Probe::measure_expected); those of which nothing is expected take four.
  int exposures = 4;
  /// Where exposures are planned: the exposure time that a frame more must save to be worth its transfer,
  /// memory and merging.
  Nanoseconds frame_cost{500'000'000};
  double ratio = 8;  ///< each exposure to the one before it
  /// The brightest pixel of the flood-lit scene fills 1 / headroom of the range of the shortest exposure.
  double headroom = 1.25;
  double scale = 1;           ///< radiance per unit of projector light that one electron per second means
  int black_photographs = 8;  ///< of the dark projector, averaged and subtracted from all that follow
  std::size_t batch = 16;     ///< photographs a run of the board: bounds the memory for raw frames
  /// Photographs between two flood-lit references that tell how bright the lamp is, 0 = none. While it holds
  /// still they come up to eight times more rarely.
  int reference_every = 50;
  double lamp_drift = 0.02;  ///< the lamp's relative change over 1,000 photographs, one sigma, as expected
  LedgerOptions ledger;      ///< when a frame is trusted
  int retakes = 5;           ///< of one photograph, before the rig gives up
  /// A camera that has sent nothing for so long after a run will send nothing more.
  Nanoseconds frame_patience{1'000'000'000};
  /// How long a photograph is held back for a frame too many that would put it in doubt.
  Nanoseconds linger{20'000'000};
  /// How long a device that was lost is waited for, if the rig knows how to open it again.
  Nanoseconds device_patience{30'000'000'000};
  /// Asked while the rig waits for a device; false: give up. Empty: never.
  std::function<bool()> wanted;
  /// Waits between two looks for a lost device. Empty: sleeps.
  std::function<void(Nanoseconds)> pause;
  /// How frames are read.
  std::shared_ptr<const FrameReading> reading = std::make_shared<FrameReading>();
  ViewLayout views;            ///< that tile the grid: mirrors in one picture, or pairs side by side
  std::string name = "a rig";  ///< for describe()
};

/// The exposures of one photograph, shortest first.
using Exposures = std::vector<Nanoseconds>;

/// How bright the lamp is, in units of the first reference photograph.
struct LampLevel {
  double value = 1;
  double sigma = 0;
};

/// What went wrong and was put right.
struct RigTrouble {
  FrameCounts frames;                ///< by verdict, those of all runs; `certain` ones were used
  std::int64_t retaken = 0;          ///< photographs taken again, as often as they were
  std::int64_t unanswered = 0;       ///< triggers that the camera did not answer
  std::int64_t unasked = 0;          ///< exposures that no trigger asked for
  std::int64_t spoiled_runs = 0;     ///< the board was late or lost events
  std::int64_t patterns_late = 0;    ///< the screen did not say that the pattern was there in time
  std::int64_t boards_reopened = 0;  ///< or configured anew after a restart
  std::int64_t cameras_reopened = 0;
  std::int64_t projectors_reopened = 0;
  /// How frames of the metered scene contradict the exposures that came with them; empty: they do not.
  std::string exposures;
};

class BracketTaker;
class DeviceSet;
class LampLog;
struct TakenBracket;

/// base, base · ratio, … base · ratio^(count − 1), each in whole nanoseconds. The base is the longest one, at
/// most `wanted` (what just does not saturate), whose last exposure the camera can hold.
/// fails: limit (the shortest would be below the camera's minimum).
Result<std::vector<Nanoseconds>> plan_exposures(Nanoseconds wanted, int count, double ratio,
                                                const CameraTiming& timing);

/// A board, a projector and a camera that answer patterns as a Probe. Each batch: the projector takes the
/// patterns, the board runs a bracket program and reports marks and strobe edges, the ledger ties frames to
/// marks, hdr merges each bracket with the exposure times that the board measured. A projector paced by the
/// host is shown each pattern by itself, and the board runs one bracket.
/// No photograph is ever returned unless every frame of its bracket is certain (CameraLedger): others are
/// taken again. A device that was lost is waited for and opened again, if the rig knows how.
/// Photographs are in units of the light of the first reference: each is divided by the lamp level that the
/// references before it foretell. The level's own error, camera noise over √pixels, is common to a photograph
/// and not added to its variance: it is below 1 % of it from 32 × 32 pixels on.
class Rig final : public Probe {
 public:
  /// Opens the devices, configures the board, meters the flood-lit scene to set the exposures, and
  /// photographs the dark projector. fails: size_mismatch (camera and projector grids differ: such a rig
  /// needs calibration), device errors, limit (the scene is too bright for the shortest exposure),
  /// frame_missing (a photograph was not certain after all retakes; the message says what was wrong with its
  /// frames).
  static Result<std::unique_ptr<Rig>> open(RigDevices devices, RigOptions options);
  /// The same of devices that are open already, and that nobody can open again.
  static Result<std::unique_ptr<Rig>> open(Board board, std::unique_ptr<Projector> projector,
                                           std::unique_ptr<Camera> camera, RigOptions options);

  ~Rig() override;
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  Grid grid() const override;
  ViewLayout views() const override { return options_.views; }
  int channels() const override;
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return measure_expected(patterns, {});
  }
  bool plans_exposures(std::size_t /*photographs*/) const override { return planned(); }
  /// expected: one a pattern, or none at all.
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override;
  /// Metering, black, reference and retaken photographs and guard frames count as frames and rig time, not as
  /// photographs. rig_seconds is the time the board's programs ran, on its clock.
  ProbeCost cost() const override;
  std::string describe() const override { return options_.name; }

  /// Of photographs of which nothing is expected.
  std::span<const Nanoseconds> exposures() const { return exposures_; }
  /// What the dark projector leaves, already subtracted from every photograph.
  const std::optional<Radiance>& black() const { return black_; }
  /// Where the references put the lamp now.
  LampLevel lamp() const;
  /// What went wrong so far and was put right.
  const RigTrouble& trouble() const;

  /// Counts photographs of an earlier session as if this one had taken them, on a rig that can repeat time:
  /// the references that came between them are taken again, each at its place. passed: called with the
  /// number of photographs in a row that are left out.  fails: as measure().
  Result<void> pass_over(std::int64_t photographs, const std::function<void(std::int64_t)>& passed);

 private:
  explicit Rig(RigOptions options);

  Result<void> begin(std::unique_ptr<DeviceSet> devices);
  Result<void> meter();
  Result<void> photograph_black();
  Result<void> refine_black(const Expectation& expected);
  bool planned() const { return options_.exposures == 0; }
  Result<std::vector<Exposures>> choose(std::span<const Pattern> patterns,
                                        std::span<const Expectation> expected);
  std::size_t in_one_run(std::span<const Exposures> brackets) const;
  Result<void> check(std::span<const Pattern> patterns) const;
  Result<void> refer();
  Result<std::vector<Radiance>> photograph(std::span<const Pattern> patterns,
                                           std::span<const Exposures> brackets, const LampLog* lamp);
  Result<Radiance> merge_one(const TakenBracket& bracket, double lamp) const;
  Result<std::vector<Radiance>> merge_all(std::span<const TakenBracket> brackets, const LampLog* lamp);

  RigOptions options_;
  std::unique_ptr<BracketTaker> taker_;  // looks at options_
  Exposures exposures_;
  std::optional<Radiance> black_;
  double black_for_ = std::numeric_limits<double>::infinity();  // noise of photographs it was refined for
  std::unique_ptr<LampLog> lamp_;                               // none: photographs stay as they are
  std::int64_t shown_ = 0;        // photographs since it was opened, references included
  std::int64_t photographs_ = 0;  // answered
  double merge_seconds_ = 0;
};

}  // namespace symrig
