// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/registered_probe.hpp"

#include "symrig/base/time.hpp"

#include <fmt/format.h>

namespace symrig {

namespace {

Result<CellWeights> weights_of(const Registration& registration, const std::optional<BayerPattern>& mosaic) {
  return mosaic ? registration.weights_of_mosaic(*mosaic) : registration.weights();
}

}  // namespace

Result<std::unique_ptr<RegisteredProbe>> RegisteredProbe::make(std::unique_ptr<Probe> rig,
                                                               const Registration& registration,
                                                               const std::optional<BayerPattern>& mosaic) {
  const auto fit = [](const char* what, Grid registered, Grid now) -> Result<void> {
    if (registered == now) return {};
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the registration is of {} {}, but the rig has {}", to_string(registered), what,
                             to_string(now)),
                 "calibrate the rig again"};
  };
  SYMRIG_CHECK(fit("cells", registration.cells, rig->grid()));
  SYMRIG_CHECK(fit("camera pixels", registration.camera(), rig->camera_grid()));
  if (registration.flood.mean.channels() != rig->channels())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the registration has {} channels, but the rig has {}",
                             registration.flood.mean.channels(), rig->channels()),
                 "calibrate the rig again"};
  SYMRIG_TRY(CellWeights weights, weights_of(registration, mosaic));
  return std::unique_ptr<RegisteredProbe>(
      new RegisteredProbe(std::move(rig), std::move(weights), registration.error(), mosaic));
}

std::string RegisteredProbe::identity() const {
  return fmt::format("{}, registration {:08x}", rig_.identity(), digest_);
}

Result<std::vector<Radiance>> RegisteredProbe::gather(const Result<std::vector<Radiance>>& photographs) {
  if (!photographs) return photographs.error();
  const Stopwatch watch;
  std::vector<Radiance> cells;
  cells.reserve(photographs->size());
  for (const Radiance& photograph : *photographs) {
    SYMRIG_TRY(auto one, weights_.gather(photograph));
    cells.push_back(std::move(one));
  }
  gather_seconds_ += watch.seconds();
  return cells;
}

void RegisteredProbe::watch_motion(MotionWatch watch, std::int64_t every, double most) {
  watch_ = std::move(watch);
  every_ = every;
  until_check_ = 0;
  most_ = most;
}

Result<void> RegisteredProbe::check_motion() {
  if (!watch_) return {};
  until_check_ = every_;
  SYMRIG_TRY(const Motion motion, watch_->measure(rig_));
  if (motion.distance() <= most_ + 3 * motion.sigma) return {};
  if (again_) return move_to_new_place();
  return Error{
      ErrorCode::fault,
      fmt::format("the rig has moved since its registration: by {:+.3f} cells along the rows and {:+.3f} "
                  "along the columns (± {:.1g}), and {:.3g} is allowed",
                  motion.row, motion.col, motion.sigma, most_),
      "fasten camera and projector, calibrate the rig again, and capture anew"};
}

/// The rig stays where it is now.
Result<void> RegisteredProbe::move_to_new_place() {
  SYMRIG_TRY(const Registration found, again_(rig_));
  SYMRIG_TRY(weights_, weights_of(found, mosaic_));
  map_error_ = found.error();
  watch_ = found.watch(watch_->mosaic());
  ++registered_again_;
  return {};
}

Result<void> RegisteredProbe::watch_before(std::size_t photographs) {
  if (!watch_) return {};
  if (until_check_ <= 0) SYMRIG_CHECK(check_motion());
  until_check_ -= static_cast<std::int64_t>(photographs);
  return {};
}

Result<std::vector<Radiance>> RegisteredProbe::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(watch_before(patterns.size()));
  return gather(rig_.measure(patterns));
}

Result<std::vector<Radiance>> RegisteredProbe::measure_expected(std::span<const Pattern> patterns,
                                                                std::span<const Expectation> expected) {
  SYMRIG_CHECK(watch_before(patterns.size()));
  std::vector<Expectation> of_pixels(expected.begin(), expected.end());
  for (Expectation& one : of_pixels)
    for (ExpectedPart& part : one.parts) part.noise /= weights_.noise_share();
  return gather(rig_.measure_expected(patterns, of_pixels));
}

ProbeCost RegisteredProbe::cost() const {
  ProbeCost cost = rig_.cost();
  cost.merge_seconds += gather_seconds_;
  return cost;
}

}  // namespace symrig
