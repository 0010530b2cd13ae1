// SPDX-License-Identifier: Apache-2.0
#include "calibration/fitting/spline_surface.hpp"
#include "calibration/registration/registration_steps.hpp"
#include "symrig/calibration/camera_optics.hpp"
#include "symrig/calibration/coaxial_check.hpp"
#include "symrig/calibration/registered_probe.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace symrig::calibration {
namespace {

constexpr int kChecks = 3;
/// [cells] Nothing below this changes a capture.
constexpr double kSmallest = 0.0005;

/// look(p) = p + shift. A smooth surface through points of a plane is the plane.
CameraMapNumbers straight_map(Grid grid, Point shift, double error) {
  constexpr int kIntervals = 4, kPoints = 8;
  std::vector<SeenValue> rows, cols;
  for (int i = 0; i <= kPoints; ++i)
    for (int j = 0; j <= kPoints; ++j) {
      const Point at{static_cast<double>(i * grid.rows) / kPoints,
                     static_cast<double>(j * grid.cols) / kPoints};
      rows.push_back({at, at.row + shift.row, 1});
      cols.push_back({at, at.col + shift.col, 1});
    }
  SplineSurface row(grid, kIntervals), col(grid, kIntervals);
  row.fit(rows, 1);
  col.fit(cols, 1);
  const auto of = [](const SplineSurface& surface) {
    return std::vector<double>(surface.coefficients().begin(), surface.coefficients().end());
  };
  return {.camera = grid,
          .intervals = kIntervals,
          .row = of(row),
          .col = of(col),
          .error = error,
          .edge_width = 1};
}

/// Corrects photographs by what is known of the camera.
Result<CellWeights> weights_of(const Registration& found) {
  SYMRIG_TRY(CellWeights weights,
             CellWeights::unmixing(found.cells, found.flood.mean.channels(), *found.shift));
  if (found.ghost.found) SYMRIG_CHECK(weights.subtract_ghost(found.corners(), found.ghost));
  return weights;
}

Result<CoaxialCheck> check_with(Probe& rig, const Registration& found) {
  if (found.shift->row == 0 && found.shift->col == 0 && !found.ghost.found) return check_coaxial(rig);
  SYMRIG_TRY(CellWeights weights, weights_of(found));
  RegisteredProbe corrected(rig, std::move(weights));
  return check_coaxial(corrected);
}

/// Finds the shift by axis checks, each with the shift that the last one left.
Result<void> find_shift(Probe& rig, const Progress& progress, Registration& found) {
  for (int k = 0; k < kChecks; ++k) {
    if (progress && !progress({"axis check", k, kChecks, kNoneToCome}))
      return Error{ErrorCode::interrupted, "calibration stopped during the axis check", "run it again"};
    SYMRIG_TRY(const CoaxialCheck check, check_with(rig, found));
    if (!check.rows.measured || !check.cols.measured)
      return Error{ErrorCode::bad_value, "the camera's shift cannot be measured: " + check.to_string(),
                   "light the scene, or use a larger grid"};
    // The camera sees at x what the rig has at x + shift.
    found.shift = {found.shift->row + check.rows.shift.value, found.shift->col + check.cols.shift.value};
    const double error = std::hypot(check.rows.shift.sigma, check.cols.shift.sigma) / std::sqrt(2);
    SYMRIG_TRY(CameraMap map, CameraMap::make(straight_map(found.cells, *found.shift, error)));
    found.maps = {std::move(map)};
    SYMRIG_CHECK(weights_of(found));
    if (std::max(std::abs(check.rows.shift.value), std::abs(check.cols.shift.value)) < kSmallest) break;
  }
  return {};
}

}  // namespace

Result<Registration> register_shared_grid(Probe& rig, const RegistrationOptions& options) {
  Registration found;
  found.cells = rig.grid();
  found.shift = Point{};
  const Pattern white(rig.grid(), 1, 1.F);
  SYMRIG_TRY(auto photographs, rig.measure({&white, 1}));
  found.flood = std::move(photographs.front());
  found.shares = Image<float>(found.camera(), 2, 1.F);
  SYMRIG_CHECK(find_shift(rig, options.progress, found));
  if (!rig.views().single()) return found;
  // A ghost is one-sided light like that of a shift, so the shift is found again without it.
  SYMRIG_TRY(const CellWeights by_area,
             CellWeights::make(found.cells, found.corners(), found.flood, {.weighting = Weighting::area}));
  SYMRIG_TRY(found.ghost, measure_ghost(rig, by_area, found.corners(), options.progress));
  if (found.ghost.found) SYMRIG_CHECK(find_shift(rig, options.progress, found));
  return found;
}

}  // namespace symrig::calibration
