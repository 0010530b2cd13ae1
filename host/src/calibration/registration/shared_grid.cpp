// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/shared_grid.hpp"

#include "calibration/registration/spline_surface.hpp"
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

Result<CoaxialCheck> check_with(Probe& rig, Point shift) {
  if (shift.row == 0 && shift.col == 0) return check_coaxial(rig);
  SYMRIG_TRY(CellWeights weights, CellWeights::unmixing(rig.grid(), rig.channels(), shift));
  RegisteredProbe corrected(rig, std::move(weights));
  return check_coaxial(corrected);
}

}  // namespace

Result<Registration> register_shared_grid(Probe& rig, const RegistrationOptions& options) {
  Point shift;
  double error = 0;
  for (int k = 0; k < kChecks; ++k) {
    if (options.progress && !options.progress({"axis check", k, kChecks, kNoneToCome}))
      return Error{ErrorCode::interrupted, "calibration stopped during the axis check", "run it again"};
    SYMRIG_TRY(const CoaxialCheck check, check_with(rig, shift));
    if (!check.rows.measured || !check.cols.measured)
      return Error{ErrorCode::bad_value, "the camera's shift cannot be measured: " + check.to_string(),
                   "light the scene, or use a larger grid"};
    // The camera sees at x what the rig has at x + shift.
    shift = {shift.row + check.rows.shift.value, shift.col + check.cols.shift.value};
    error = std::hypot(check.rows.shift.sigma, check.cols.shift.sigma) / std::sqrt(2);
    SYMRIG_CHECK(CellWeights::unmixing(rig.grid(), rig.channels(), shift));
    if (std::max(std::abs(check.rows.shift.value), std::abs(check.cols.shift.value)) < kSmallest) break;
  }
  Registration found;
  found.cells = rig.grid();
  found.shift = shift;
  SYMRIG_TRY(CameraMap map, CameraMap::make(straight_map(rig.grid(), shift, error)));
  found.maps.push_back(std::move(map));
  const Pattern white(rig.grid(), 1, 1.F);
  SYMRIG_TRY(auto photographs, rig.measure({&white, 1}));
  found.flood = std::move(photographs.front());
  found.shares = Image<float>(found.camera(), 2, 1.F);
  return found;
}

}  // namespace symrig::calibration
