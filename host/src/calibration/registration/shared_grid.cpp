// SPDX-License-Identifier: Apache-2.0
#include "calibration/registration/shared_grid.hpp"

#include "symrig/calibration/coaxial_check.hpp"
#include "symrig/calibration/registered_probe.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::calibration {
namespace {

constexpr int kChecks = 3;
/// [cells] Nothing below this changes a capture.
constexpr double kSmallest = 0.0005;

/// look(p) = p + shift, as splines hold it: the coefficients of a straight line lie on it.
CameraMapNumbers straight_map(Grid grid, Point shift, double error) {
  constexpr int kIntervals = 4, kMore = 3;
  CameraMapNumbers map{.camera = grid, .intervals = kIntervals, .row = {}, .col = {}};
  const double step = static_cast<double>(std::max(grid.rows, grid.cols)) / kIntervals;
  const int rows = static_cast<int>(std::ceil(grid.rows / step - 1e-9)) + kMore;
  const int cols = static_cast<int>(std::ceil(grid.cols / step - 1e-9)) + kMore;
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < cols; ++j) {
      map.row.push_back((i - 1) * step + shift.row);
      map.col.push_back((j - 1) * step + shift.col);
    }
  map.error = error;
  map.edge_width = 1;
  return map;
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
