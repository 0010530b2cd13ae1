// SPDX-License-Identifier: Apache-2.0
#include "symrig/calibration/registered_probe.hpp"

#include "symrig/base/time.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig {

namespace {

Result<CellWeights> weights_of(const Registration& registration, const std::optional<BayerPattern>& mosaic) {
  return mosaic ? registration.weights_of_mosaic(*mosaic) : registration.weights();
}

/// A photograph is at most the flood-lit one, so a step of 4e-5 of it leaves room for noise in 16 bits. What
/// is dark is kept to a part of the noise of a photograph; the registration's is the mean of some tens.
Image<float> steps_of(const Registration& registration) {
  constexpr float kStep = 4e-5F, kSigmas = 16, kDarkest = 1e-6F;
  const Radiance& flood = registration.flood;
  const auto count = static_cast<float>(std::max<std::int64_t>(registration.photographs, 1));
  const auto brightest = std::ranges::max(flood.mean.values());
  const float least = brightest > 0 ? kDarkest * brightest : 1;
  Image<float> steps(flood.mean.grid(), flood.mean.channels());
  for (std::size_t i = 0; i < steps.values().size(); ++i) {
    const float noise = std::sqrt(std::max(flood.variance.values()[i], 0.F) * count);
    steps.values()[i] = kStep * std::max(std::max(flood.mean.values()[i], 0.F) + kSigmas * noise, least);
  }
  return steps;
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
  std::unique_ptr<RegisteredProbe> probe(
      new RegisteredProbe(std::move(rig), std::move(weights), registration.error(), mosaic));
  probe->registration_ = std::make_shared<const Registration>(registration);
  if (!registration.shift) probe->steps_ = std::make_shared<const Image<float>>(steps_of(registration));
  return probe;
}

std::string RegisteredProbe::identity() const {
  return fmt::format("{}, registration {:08x}", rig_.identity(), digest_);
}

Result<Radiance> RegisteredProbe::to_cells(const Radiance& photograph) {
  const Stopwatch watch;
  Result<Radiance> cells = weights_.gather(photograph);
  gather_seconds_ += watch.seconds();
  ++on_cells_;
  return cells;
}

Result<std::vector<Radiance>> RegisteredProbe::gather(const Result<std::vector<Radiance>>& photographs) {
  if (!photographs) return photographs.error();
  std::vector<Radiance> cells;
  cells.reserve(photographs->size());
  for (const Radiance& photograph : *photographs) {
    SYMRIG_TRY(auto one, to_cells(photograph));
    cells.push_back(std::move(one));
  }
  return cells;
}

void RegisteredProbe::watch_motion(MotionWatch watch, std::int64_t every, double most) {
  watch_ = std::move(watch);
  every_ = every;
  most_ = most;
}

namespace {

/// The comparison is linear in the motion: it says little of a far one.
std::string cells_away(const Motion& motion) {
  constexpr double kFarthest = 0.02;
  if (motion.distance() > kFarthest) return fmt::format("more than {:.2g} cells", kFarthest);
  return fmt::format("{:+.3f} cells along the rows and {:+.3f} along the columns (± {:.1g})", motion.row,
                     motion.col, motion.sigma);
}

}  // namespace

Result<void> RegisteredProbe::check_motion() {
  if (!watch_) return {};
  SYMRIG_TRY(const Motion motion, watch_->measure(rig_));
  if (motion.distance() <= most_ + 3 * motion.sigma) return {};
  if (again_) return move_to_new_place();
  return Error{
      ErrorCode::fault,
      fmt::format("stripes lie {} from where they were registered, and {:.3g} is allowed: the rig has moved, "
                  "the scene, light or focus is another one, or photographs are late",
                  cells_away(motion), most_),
      "fasten all; put back what has changed, or calibrate again and capture anew"};
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

/// Comparisons come after fixed numbers of photographs: then those of a capture that is continued are where
/// they would have been.
Result<void> RegisteredProbe::watch_before() {
  if (!watch_ || on_cells_ < every_ * checks_) return {};
  ++checks_;
  return check_motion();
}

Result<void> RegisteredProbe::continue_after(const ProbeCost& spent) {
  if (watch_) {
    SYMRIG_CHECK(check_motion());
    constexpr std::int64_t kEach = 2;  // photographs of a comparison
    // What was spent contains photographs that no log has: of the comparisons, and of looks at the rig. A log
    // of cells does not say how many it has. No more comparisons than these fit between the others:
    const std::int64_t most = (spent.photographs + every_ - 1) / (every_ + kEach);
    checks_ = std::min((spent.photographs - on_cells_) / kEach, most);
    on_cells_ = spent.photographs - kEach * checks_;
  }
  return rig_.continue_after(spent);
}

Result<std::vector<Radiance>> RegisteredProbe::Camera::measure(std::span<const Pattern> patterns) {
  SYMRIG_CHECK(probe_.watch_before());
  return rig_.measure(patterns);
}

Result<std::vector<Radiance>> RegisteredProbe::Camera::measure_expected(
    std::span<const Pattern> patterns, std::span<const Expectation> expected) {
  SYMRIG_CHECK(probe_.watch_before());
  std::vector<Expectation> of_pixels(expected.begin(), expected.end());
  for (Expectation& one : of_pixels)
    for (ExpectedPart& part : one.parts) part.noise /= probe_.weights_.noise_share();
  return rig_.measure_expected(patterns, of_pixels);
}

Result<std::vector<Radiance>> RegisteredProbe::measure(std::span<const Pattern> patterns) {
  return gather(camera_.measure(patterns));
}

Result<std::vector<Radiance>> RegisteredProbe::measure_expected(std::span<const Pattern> patterns,
                                                                std::span<const Expectation> expected) {
  return gather(camera_.measure_expected(patterns, expected));
}

ProbeCost RegisteredProbe::cost() const {
  ProbeCost cost = rig_.cost();
  cost.merge_seconds += gather_seconds_;
  return cost;
}

}  // namespace symrig
