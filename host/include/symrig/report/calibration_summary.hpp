// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/first_bounce.hpp"
#include "symrig/calibration/map_file.hpp"
#include "symrig/calibration/map_quality.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/calibration/smooth_map.hpp"
#include "symrig/report/summary.hpp"

#include <optional>
#include <string>

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

}  // namespace symrig
