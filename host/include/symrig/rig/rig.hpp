// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/units.hpp"
#include "symrig/camera/camera.hpp"
#include "symrig/device/board.hpp"
#include "symrig/device/bracket.hpp"
#include "symrig/projector/projector.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// How a Rig takes its photographs.
struct RigOptions {
  device::RigProfile profile;
  std::string strobe_line = "camera_strobe";  ///< high while the camera exposes
  int exposures = 4;                          ///< frames a photograph, shortest first
  double ratio = 8;                           ///< each exposure to the one before it
  /// The brightest pixel of the flood-lit scene fills 1 / headroom of the range of the shortest exposure.
  double headroom = 1.25;
  double scale = 1;           ///< radiance per unit of projector light that one electron per second means
  int black_photographs = 8;  ///< of the dark projector, averaged and subtracted from all that follow
  std::size_t batch = 16;     ///< photographs a run of the board: bounds the memory for raw frames
  /// Photographs between two flood-lit references that tell how bright the lamp is, 0 = none. While it holds
  /// still they come up to eight times more rarely.
  int reference_every = 50;
  double lamp_drift = 0.02;    ///< the lamp's relative change over 1,000 photographs, one sigma, as expected
  ViewLayout views;            ///< that tile the grid: mirrors in one picture, or pairs side by side
  std::string name = "a rig";  ///< for describe()
};

/// How bright the lamp is, in units of the first reference photograph.
struct LampLevel {
  double value = 1;
  double sigma = 0;
};

class LampLog;

/// base, base · ratio, … base · ratio^(count − 1), each in whole nanoseconds. The base is the longest one, at
/// most `wanted` (what just does not saturate), whose last exposure the camera can hold.
/// fails: limit (the shortest would be below the camera's minimum).
Result<std::vector<Nanoseconds>> plan_exposures(Nanoseconds wanted, int count, double ratio,
                                                const CameraTiming& timing);

/// A board, a projector and a camera that answer patterns as a Probe. Each batch: the projector takes the
/// patterns, the board runs a bracket program and reports marks and strobe edges, the ledger ties frames to
/// marks, hdr merges each bracket with the exposure times that the board measured.
/// No photograph is ever returned unless every frame of its run is accounted for.
/// Photographs are in units of the light of the first reference: each is divided by the lamp level that the
/// references before it foretell. The level's own error, camera noise over √pixels, is common to a photograph
/// and not added to its variance: it is below 1 % of it from 32 × 32 pixels on.
class Rig final : public Probe {
 public:
  /// Configures the board, meters the flood-lit scene to set the exposures, and photographs the dark
  /// projector. fails: size_mismatch (camera and projector grids differ: such a rig needs calibration),
  /// device errors, limit (the scene is too bright for the shortest exposure).
  static Result<std::unique_ptr<Rig>> open(device::Board board, std::unique_ptr<Projector> projector,
                                           std::unique_ptr<Camera> camera, RigOptions options);

  ~Rig() override;
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  Grid grid() const override { return camera_->grid(); }
  ViewLayout views() const override { return options_.views; }
  int channels() const override { return camera_->channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;
  /// Metering, black and reference photographs count as frames and rig time, not as photographs. rig_seconds
  /// is the time the board's programs ran, on its clock.
  ProbeCost cost() const override { return cost_; }
  std::string describe() const override { return options_.name; }

  std::span<const Nanoseconds> exposures() const { return exposures_; }
  /// What the dark projector leaves, already subtracted from every photograph.
  const std::optional<Radiance>& black() const { return black_; }
  /// Where the references put the lamp now.
  LampLevel lamp() const;

  /// Counts photographs of an earlier session as if this one had taken them, on a rig that can repeat time:
  /// the references that came between them are taken again, each at its place. passed: called with the
  /// number of photographs in a row that are left out.  fails: as measure().
  Result<void> pass_over(std::int64_t photographs, const std::function<void(std::int64_t)>& passed);

 private:
  Rig(device::Board board, std::unique_ptr<Projector> projector, std::unique_ptr<Camera> camera,
      RigOptions options);

  struct Shots;  // the frames of one run, tied to their photographs
  Result<void> configure();
  Result<void> meter();
  Result<void> photograph_black();
  Result<void> check(std::span<const Pattern> patterns) const;
  Result<void> refer();
  Result<std::vector<Radiance>> photograph(std::span<const Pattern> patterns, const LampLog* lamp);
  Result<Shots> expose(std::span<const Pattern> patterns, std::span<const Nanoseconds> exposures);
  Result<device::Receipt> run(std::span<const Nanoseconds> exposures, std::size_t photographs);
  Result<std::vector<Nanoseconds>> measured_exposures(const device::Receipt& receipt,
                                                      std::size_t expected) const;
  Result<Radiance> merge_one(const Shots& shots, std::size_t photograph, double lamp) const;
  Result<std::vector<Radiance>> merge_all(const Shots& shots, const LampLog* lamp);

  device::Board board_;
  std::unique_ptr<Projector> projector_;
  std::unique_ptr<Camera> camera_;
  RigOptions options_;
  std::vector<Nanoseconds> exposures_;
  std::optional<Radiance> black_;
  std::unique_ptr<LampLog> lamp_;  // none: photographs stay as they are
  std::int64_t shown_ = 0;         // photographs since it was opened, references included
  ProbeCost cost_;
};

}  // namespace symrig
