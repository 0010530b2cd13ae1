// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/cell_weights.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/image/view_layout.hpp"
#include "symrig/report/made.hpp"

#include <string>
#include <vector>

namespace symrig {

/// The results of `symrig calibrate` for a camera with pixels of its own.
struct RegistrationSummary {
  const Registration& registration;
  const CellWeights& weights;
  double rig_seconds = 0;  ///< on the rig's clock
  Made made = {};
  ViewLayout views = {};  ///< of the rig
  MapShape shape = registration.shape();
};

/// The JSON of `symrig calibrate --json`.
std::string registration_json(const RegistrationSummary& summary);

/// What a person must know of the rig, a sentence each.
std::vector<std::string> registration_warnings(const RegistrationSummary& summary);

/// The share of a ghost, its place, and what to do about it.
std::string ghost_text(const CameraGhost& ghost);

/// The same as lines of text.
std::string registration_text(const RegistrationSummary& summary);

/// One self-contained HTML page: the cells drawn into the camera's picture, what the lens does beyond a
/// straight map, and the scene on the cells.
/// fails: as CellWeights::gather.
Result<std::string> registration_page(const RegistrationSummary& summary);

}  // namespace symrig
