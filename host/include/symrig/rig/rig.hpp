// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/board.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/program/program_file.hpp"
#include "symrig/projector/projector.hpp"
#include "symrig/rig/camera_ledger.hpp"
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

/// Functions that open the three devices of a rig, at first and again after one was lost. Each may be called
/// many times; the previous object is destroyed before the call. The first order is board, camera, projector.
struct RigDevices {
  std::function<Result<Board>()> board;
  std::function<Result<std::unique_ptr<Projector>>()> projector;
  std::function<Result<std::unique_ptr<Camera>>()> camera;
};

/// Frames of a photograph of which nothing is foreseen, as in a calibration: planning has nothing to go by.
inline constexpr int kUnforeseenExposures = 4;

/// How a Rig takes its photographs.
struct RigOptions {
  /// The connected lines, and the timing of projector and camera. Without a strobe line, the camera's trigger
  /// line shows the exposures.
  RigSetup setup = default_rig_setup();
  /// From the end of an exposure to the next trigger if they do not overlap a readout. None: the readout.
  std::optional<Nanoseconds> gap;
  /// How long after its mark a strobe may rise.
  Nanoseconds strobe_tolerance{1'000'000};
  /// Frames of a photograph, shortest first. 0: planned for each photograph from its expectation
  /// (Probe::measure_expected). Photographs without an expectation then get kUnforeseenExposures.
  int exposures = 0;
  /// For planned exposures: a further frame must save at least this exposure time. None: the time from the
  /// end of an exposure to the next one, and what it takes to merge the frame.
  std::optional<Nanoseconds> frame_cost;
  double ratio = 8;  ///< each exposure divided by the previous one
  /// The brightest pixel of the flood-lit scene fills 1 / headroom of the range of the shortest exposure.
  double headroom = 1.25;
  double scale = 1;           ///< radiance per unit of projector light, for one electron per second
  int black_photographs = 8;  ///< photographs of the dark projector; later ones subtract their average
  std::size_t batch = 16;     ///< photographs in one run of the board; limits the memory for raw frames
  /// Photographs between two flood-lit references, which measure the lamp's brightness. 0 = none. If the lamp
  /// is stable, the distance grows up to eight times.
  int reference_every = 50;
  double lamp_drift = 0.02;  ///< expected relative change of the lamp over 1,000 photographs, one sigma
  LedgerOptions ledger;      ///< when a frame is trusted
  int retakes = 5;           ///< of one photograph, before the rig reports an error
  /// What the capture that opens the rig may take in all [s]. If exposures are planned, those of the opening
  /// take 0.3 of it at most.
  double most_seconds = std::numeric_limits<double>::infinity();
  /// After a run, the rig stops waiting after this time without a frame.
  Nanoseconds frame_patience{1'000'000'000};
  /// After the last expected frame, the rig waits this long for an extra frame. An extra frame puts the
  /// photograph in doubt.
  Nanoseconds linger{20'000'000};
  /// How long the rig waits for a lost device, if it can open it again.
  Nanoseconds device_patience{30'000'000'000};
  /// The rig calls it while it waits for a device. false: stop waiting. Empty: wait for all of
  /// device_patience.
  std::function<bool()> keep_waiting;
  /// Waits between two attempts to open a lost device. Empty: sleeps.
  std::function<void(Nanoseconds)> pause;
  /// Converts frames to radiance.
  std::shared_ptr<const FrameReading> reading = std::make_shared<FrameReading>();
  ViewLayout views;            ///< views that tile the grid: mirrors in one picture, or pairs side by side
  std::string name = "a rig";  ///< for describe()
};

/// The exposures of one photograph, shortest first.
using Exposures = std::vector<Nanoseconds>;

/// The lamp's brightness, in units of the first reference photograph.
struct LampLevel {
  double value = 1;
  double sigma = 0;
};

/// Problems that the rig found and solved.
struct RigTrouble {
  FrameCounts frames;                ///< by verdict, over all runs; only `certain` frames were used
  std::int64_t retaken = 0;          ///< how many photographs were taken again, counting each retake
  std::int64_t unanswered = 0;       ///< triggers without an exposure
  std::int64_t unasked = 0;          ///< exposures without a trigger
  std::int64_t spoiled_runs = 0;     ///< runs in which the board was late or lost events
  std::int64_t patterns_late = 0;    ///< the screen did not report the pattern in time
  std::int64_t planes_doubtful = 0;  ///< exposures that the edges did not prove to be in their bit planes
  std::int64_t boards_reopened = 0;  ///< reopened, or configured again after a restart
  std::int64_t cameras_reopened = 0;
  std::int64_t projectors_reopened = 0;
  std::int64_t registered_again = 0;  ///< a registered rig had moved, and was registered again
  /// How the frames of the flood-lit scene contradict their exposure times. Empty: no contradiction.
  std::string exposures;
  /// What could not be checked when the rig was opened, or what it could not leave as it was: one line each.
  std::vector<std::string> warnings;
};

/// Where the time on the rig's clock went [seconds]. The parts sum to ProbeCost::rig_seconds.
struct RigTime {
  double light = 0;      ///< the shutter was open
  double camera = 0;     ///< nothing was exposed because the camera read out a frame
  double projector = 0;  ///< the rest: waiting for a refresh, and until the pattern has settled
};

class BracketTaker;
class DeviceSet;
class LampLog;
struct TakenBracket;

/// Exposures base, base · ratio, … base · ratio^(count − 1), each in whole nanoseconds. The base is at most
/// `wanted`, which just does not saturate. It is smaller if the last exposure would exceed the camera's
/// maximum.
/// fails: limit (the shortest would be below the camera's minimum).
Result<std::vector<Nanoseconds>> plan_exposures(Nanoseconds wanted, int count, double ratio,
                                                const CameraTiming& timing);

/// A board, a projector and a camera that measure patterns as a Probe. For each batch, the projector loads
/// the patterns. The board runs a bracket program and reports marks and strobe edges. The ledger assigns
/// frames to marks. Then hdr merges each bracket with the exposure times that the board measured. With a
/// projector of Pacing::host, the rig shows one pattern at a time, and the board runs one bracket.
///
/// The rig returns a photograph only if every frame of its bracket is certain (CameraLedger). It takes other
/// photographs again. It waits for a lost device and opens it again, if it can.
///
/// Photographs are in units of the light of the first reference. Each one is divided by the lamp level that
/// earlier references predict. The level's error is camera noise over √pixels. All pixels of a photograph
/// share it, so it is not in the variance. From 32 × 32 pixels on it is below 1 % of the variance.
class Rig final : public Probe {
 public:
  /// Opens the devices, configures the board, meters the flood-lit scene to set the exposures, and
  /// photographs the dark projector.
  /// fails: device errors, limit (the scene is too bright for the shortest exposure), frame_missing (a
  /// photograph was not certain after all retakes; the message describes its frames).
  static Result<std::unique_ptr<Rig>> open(RigDevices devices, RigOptions options);
  /// The same with open devices. The rig cannot open them again after a loss.
  static Result<std::unique_ptr<Rig>> open(Board board, std::unique_ptr<Projector> projector,
                                           std::unique_ptr<Camera> camera, RigOptions options);

  ~Rig() override;
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  Grid grid() const override;
  Grid camera_grid() const override;
  ViewLayout views() const override { return options_.views; }
  int channels() const override;
  /// The colour filters of the camera's pixels, whose samples are one channel.
  Mosaic mosaic() const;
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override {
    return measure_expected(patterns, {});
  }
  bool plans_exposures(std::size_t /*photographs*/) const override { return planned(); }
  bool held_short() const override { return held_short_; }
  /// With bit planes, a run of the board takes many photographs.
  std::size_t together() const override;
  bool computes() const override { return false; }
  /// expected: one per pattern, or empty.
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override;
  /// Metering, black, reference, retaken and guard frames count as frames and rig time, not as photographs.
  /// rig_seconds: the run time of the board's programs, on the board's clock.
  ProbeCost cost() const override;
  std::string describe() const override { return options_.name; }
  /// Since the rig was opened.
  RigTime time() const;

  /// Exposures of a photograph without an expectation.
  std::span<const Nanoseconds> exposures() const { return exposures_; }
  /// Photograph of the dark projector. It is already subtracted from every photograph.
  const std::optional<Radiance>& black() const { return black_; }
  /// The lamp's present level, from the references.
  LampLevel lamp() const;
  /// The problems that the rig has found and solved so far.
  RigTrouble trouble() const;

  /// For a rig that can repeat time: counts photographs of an earlier run of symrig as its own. Takes the
  /// references between them again, each at its place. passed: called with the number of consecutive
  /// photographs that are skipped.
  /// fails: as measure().
  Result<void> pass_over(std::int64_t photographs, const std::function<void(std::int64_t)>& passed);

 private:
  explicit Rig(RigOptions options);

  Result<void> begin(std::unique_ptr<DeviceSet> devices);
  Result<void> meter();
  double seconds_to_open(double share) const;
  Result<TakenBracket> metering_bracket(const Exposures& trial);
  Exposures first_black();
  ExposureRules rules_with_waits() const;
  Result<void> photograph_black(const Exposures& bracket);
  Result<void> refine_black(const Expectation& expected);
  bool shows_planes() const;
  bool planned() const { return options_.exposures == 0; }
  Result<std::vector<Exposures>> choose(std::span<const Pattern> patterns,
                                        std::span<const Expectation> expected);
  /// A bracket, what it takes [s], and what it would take if the projector's black were dark.
  struct BlackPlan {
    BracketPlan plan;
    double seconds = 0, seconds_without_black = 0;
  };
  Result<BlackPlan> plan_with_black(const Expectation& expected, const LightPath& path) const;
  double brightest_light() const;
  std::optional<std::string> black_warning() const;
  std::size_t in_one_run(std::span<const Exposures> brackets) const;
  Result<void> refer();
  Result<void> check_shown_planes();
  Result<std::vector<Radiance>> photograph(std::span<const Pattern> patterns,
                                           std::span<const Exposures> brackets, const LampLog* lamp);
  Result<Radiance> merge_one(const TakenBracket& bracket, double lamp) const;
  Result<std::vector<Radiance>> merge_all(std::span<const TakenBracket> brackets, const LampLog* lamp);

  RigOptions options_;
  std::unique_ptr<BracketTaker> taker_;  // uses options_
  CameraTiming timing_;                  // of camera and projector together
  Exposures exposures_;
  std::optional<Radiance> black_;
  double black_for_ = std::numeric_limits<double>::infinity();  // photographs' noise that it suits
  std::size_t black_exposures_ = 0;                             // of the last photograph that was not planned
  double planned_seconds_ = 0;                                  // of photographs,
  double seconds_without_black_ = 0;                            // and if black were dark
  double black_seconds_ = 0;       // it was ended by so few seconds; 0: it is as good as was wanted
  Nanoseconds frame_waits_{0};     // what a frame of the first black took besides its exposure
  bool opened_short_ = false;      // a budget of seconds ended metering or the first black
  bool held_short_ = false;        // of the last photographs
  Expectation flood_lit_;          // from metering, if exposures are planned
  std::unique_ptr<LampLog> lamp_;  // none: photographs are not divided
  std::optional<std::int64_t> planes_checked_;  // after so many times that it was opened again
  std::int64_t shown_ = 0;                      // photographs since open(), references included
  std::int64_t photographs_ = 0;                // returned to the caller
  double merge_seconds_ = 0;
};

}  // namespace symrig
