// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/calibration/registration.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

namespace symrig {

/// A rig whose camera has pixels of its own, as a probe whose photographs are on the projector's cells.
class RegisteredProbe final : public Probe {
 public:
  /// Owns the rig. mosaic: the colour filters of its camera, whose photographs have one channel: cells then
  /// have three colours. None: channels are those of the rig.
  /// fails: size_mismatch (the registration is of other cells, pixels or channels); as Registration::weights
  /// and weights_of_mosaic.
  static Result<std::unique_ptr<RegisteredProbe>> make(std::unique_ptr<Probe> rig,
                                                       const Registration& registration,
                                                       const std::optional<BayerPattern>& mosaic = {});
  /// rig must outlive this. weights: from the rig's camera grid to its grid. map_error: what residual_shift()
  /// says, such as Registration::error().
  RegisteredProbe(Probe& rig, CellWeights weights, double map_error = 0)
      : rig_(rig), weights_(std::move(weights)), digest_(weights_.digest()), map_error_(map_error) {}

  Grid grid() const override { return weights_.cells(); }
  ViewLayout views() const override { return rig_.views(); }
  int channels() const override { return weights_.channels(); }
  /// The error of the map [cells].
  double residual_shift() const override { return map_error_; }
  /// fails: also size_mismatch (the registration is of another camera).
  Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;
  bool plans_exposures(std::size_t photographs) const override { return rig_.plans_exposures(photographs); }
  bool held_short() const override { return rig_.held_short(); }
  /// expected: of the cells. A camera pixel may be noisier than its cell.
  Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                 std::span<const Expectation> expected) override;
  std::size_t together() const override { return rig_.together(); }
  bool computes() const override { return rig_.computes(); }
  void tell(const TakenSome& taken) override { rig_.tell(taken); }
  ProbeCost cost() const override;
  /// Compares the rig with its registration first, because it may have moved since.
  Result<void> continue_after(const ProbeCost& spent) override;
  std::string describe() const override { return rig_.describe(); }
  /// With the registration that it began with.
  std::string identity() const override;

  const CellWeights& weights() const { return weights_; }
  /// Of the registration that it began with.
  std::uint32_t digest() const { return digest_; }
  /// What make() was given; nullptr if the probe was not made by it.
  const Registration* registration() const { return registration_.get(); }
  const std::optional<BayerPattern>& mosaic() const { return mosaic_; }

  /// The rig with its own photographs: what measure() takes before it puts them on the cells. Its
  /// expectations are of the cells.
  Probe& camera() { return camera_; }
  /// What measure() makes of a photograph of camera().  fails: size_mismatch.
  Result<Radiance> to_cells(const Radiance& photograph);
  /// So many of the last ones were of a log, and this capture takes others instead.
  void forget(std::int64_t photographs) { on_cells_ -= photographs; }
  /// The step to which a log may round each sample of camera() (LogIdentity::steps). None: a log keeps the
  /// cells, because the camera is not finer than they are, or because register_again() may change the map.
  std::shared_ptr<const Image<float>> steps() const { return again_ ? nullptr : steps_; }

  /// From now on, compares the rig with its registration before the first photograph, and again after this
  /// many: measure() fails with `fault` if the rig has moved further than `most` cells. Photographs: 2 each
  /// time. They are in cost(), but not in the log.
  void watch_motion(MotionWatch watch, std::int64_t every = 32, double most = kMostMotion);
  /// Measures a registration anew, such as register_camera().
  using Register = std::function<Result<Registration>(Probe& rig)>;
  /// From now on, a rig that has moved is registered again, and measure() goes on. Photographs since the last
  /// comparison stay as they are: up to `every` of watch_motion() may be from the moved rig.
  void register_again(Register again) { again_ = std::move(again); }
  /// How often that was done.
  std::int64_t registered_again() const { return registered_again_; }
  /// Compares now. Does nothing without watch_motion().
  /// fails: fault (the rig has moved, and is not registered again); as MotionWatch::measure and the new
  /// registration.
  Result<void> check_motion();
  /// [cells] Direct light then crosses the borders of cells, which adds up to a tenth to an error
  /// (docs/research/registration.md, A rig that has moved).
  static constexpr double kMostMotion = 0.005;

 private:
  RegisteredProbe(std::unique_ptr<Probe> rig, CellWeights weights, double map_error,
                  const std::optional<BayerPattern>& mosaic)
      : owned_(std::move(rig)),
        rig_(*owned_),
        mosaic_(mosaic),
        weights_(std::move(weights)),
        digest_(weights_.digest()),
        map_error_(map_error) {}
  /// camera()
  class Camera final : public ForwardingProbe {
   public:
    Camera(RegisteredProbe& probe, Probe& rig) : ForwardingProbe(rig), probe_(probe), rig_(rig) {}
    Result<std::vector<Radiance>> measure(std::span<const Pattern> patterns) override;
    Result<std::vector<Radiance>> measure_expected(std::span<const Pattern> patterns,
                                                   std::span<const Expectation> expected) override;

   private:
    Result<std::vector<Radiance>> seen(std::span<const Pattern> /*patterns*/,
                                       Result<std::vector<Radiance>> photographs) override {
      return photographs;
    }
    RegisteredProbe& probe_;
    Probe& rig_;
  };

  Result<void> move_to_new_place();
  Result<void> watch_before();
  Result<std::vector<Radiance>> gather(const Result<std::vector<Radiance>>& photographs);

  std::unique_ptr<Probe> owned_;  // or none
  Probe& rig_;
  Camera camera_{*this, rig_};
  std::shared_ptr<const Registration> registration_ = {};
  std::shared_ptr<const Image<float>> steps_ = {};
  std::optional<BayerPattern> mosaic_ = {};
  CellWeights weights_;
  std::uint32_t digest_;  // of the first weights
  double map_error_;      // [cells]
  double gather_seconds_ = 0;
  std::optional<MotionWatch> watch_;
  std::int64_t every_ = 0;
  std::int64_t on_cells_ = 0;  ///< photographs so far, with those of a log that this capture continues
  std::int64_t checks_ = 0;    ///< comparisons before them
  double most_ = 0;
  Register again_;
  std::int64_t registered_again_ = 0;
};

}  // namespace symrig
