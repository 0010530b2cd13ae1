// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/alignment.hpp"
#include "symrig/calibration/cell_weights.hpp"
#include "symrig/calibration/first_bounce.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/calibration/registration.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/report/summary.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// Results that only a rig gives, because its photographs have a variance and a validity.
struct RigSummary {
  double predicted_noise = 0;  ///< rms noise of a flood-lit pixel, from the variances that the rig gave
  double invalid_share = 0;    ///< camera values without a usable sample in the flood-lit photograph
  double offset_row = 0,
         offset_col = 0;   ///< mean of projector position − camera position [px], decoded pixels
  double offset_rms = 0;   ///< rms of the distance from that mean offset [px]
  double rig_seconds = 0;  ///< on the rig's clock
};

/// The results of `symrig calibrate`.
struct CalibrationSummary {
  std::string source;  ///< folder of photographs, or rig
  int photographs = 0;
  double mean_white = 0;  ///< flood-lit photograph over decoded pixels, units of the photographs
  double mean_black = 0;  ///< dark photograph over decoded pixels, same units
  MapQuality quality;     ///< from every fourth pixel of every fourth row
  std::optional<RigSummary> rig = {};
  std::optional<SmoothMap> smooth = {};  ///< of photographs from a folder, if enough pixels are decoded
};

/// Means over the decoded pixels of a sequence.
CalibrationSummary summarize(const std::string& source, const CodePhotographs& photographs,
                             const PixelMap& map);
/// Offset of the camera from the projector: the row, column and rms fields of a RigSummary. Only if both
/// grids are equal.
RigSummary offsets_of(const PixelMap& map);

/// The JSON of `symrig calibrate --json`.
std::string calibration_json(const CalibrationSummary& summary, const PixelMap& map);

/// The JSON of `symrig fit --json`; the scene file stores it too.
std::string fit_json(const std::string& source, const CodePhotographs& photographs, const FirstBounceFit& fit,
                     const std::vector<HeldOutError>& held_out, double total_seconds, const Made& made = {});

/// One self-contained HTML page about the map (no script, no request): the decoded positions, their
/// uncertainty, and where neighbours contradict them.
std::string calibration_page(const CalibrationSummary& summary, const PixelMap& map);

/// The uncertainty of the map. Channels: standard deviation of the column and of the row, distance from the
/// affine map of the neighbours [projector pixels]; −1 where there is none.
Image<float> uncertainty_picture(const PixelMap& map);

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

/// One measurement of `symrig align`.
struct AlignmentUpdate {
  std::string rig;         ///< as it describes itself
  std::int64_t count = 1;  ///< of updates so far
  double seconds = 0;      ///< since the start
  Alignment alignment;
  std::vector<AlignmentFinding> findings;
  int cell = 0;  ///< projector pixels along the side of a cell; 0: not known
};

/// One line of `symrig align --json`.
std::string alignment_json(const AlignmentUpdate& update);

/// One line for a log.
std::string alignment_line(const AlignmentUpdate& update);

/// The names of the goals that are not met, "cells seen, blur"; empty: all are.
std::string missed_goals(const std::vector<AlignmentFinding>& findings);

/// What to do for a goal that is not met, in words.
std::string advice(const AlignmentFinding& finding, const Alignment& alignment);

/// The page for the person at the screws. before: the update before this one, or nullptr.
std::string alignment_page(const AlignmentUpdate& update, const AlignmentUpdate* before);

/// A picture of what is left over of the map: a point, an arrow or a double arrow for each part of the
/// camera's picture, by length. columns: of the terminal.
std::string left_over_picture(const Alignment& alignment, std::size_t columns);

}  // namespace symrig
