// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/first_bounce.hpp"
#include "symrig/calibration/map_file.hpp"
#include "symrig/calibration/map_quality.hpp"
#include "symrig/calibration/pixel_map.hpp"
#include "symrig/report/summary.hpp"

#include <optional>
#include <string>

namespace symrig {

/// What only a rig can tell beside the pixel map: it answers with a variance and a validity.
struct RigSummary {
  double predicted_noise =
      0;  ///< rms of one flood-lit photograph's pixel, from the variances that the rig gave
  double invalid_share = 0;  ///< camera values without a usable sample in the flood-lit photograph
  double offset_row = 0,
         offset_col = 0;   ///< mean of projector position − camera position [px], decoded pixels
  double offset_rms = 0;   ///< rms of the distance from that mean offset [px]
  double rig_seconds = 0;  ///< on the rig's clock
};

/// What `symrig calibrate` found out.
struct CalibrationSummary {
  std::string source;  ///< folder of photographs, or rig
  int photographs = 0;
  double mean_white = 0;  ///< flood-lit photograph over decoded pixels, units of the photographs
  double mean_black = 0;  ///< dark photograph over decoded pixels, same units
  MapQuality quality;     ///< every fourth pixel of every fourth row judged
  std::optional<RigSummary> rig = {};
};

/// Means over the decoded pixels of a sequence.
CalibrationSummary summarize(const std::string& source, const CodePhotographs& photographs,
                             const PixelMap& map);
/// Offset of the camera against the projector: row, column and rms fields of a RigSummary. Only where both
/// grids are the same.
RigSummary offsets_of(const PixelMap& map);

/// The keys of `symrig calibrate --json`.
std::string calibration_json(const CalibrationSummary& summary, const PixelMap& map);

/// The keys of `symrig fit --json`, kept in the scene file too.
std::string fit_json(const std::string& source, const CodePhotographs& photographs, const FirstBounceFit& fit,
                     const std::vector<HeldOutError>& held_out, double total_seconds, const Made& made = {});

/// The map for people: one self-contained HTML page (no script, no request) with what was decoded, how well
/// each position is known and where neighbours contradict it.
std::string calibration_page(const CalibrationSummary& summary, const PixelMap& map);

/// How well the map is known: channels standard deviation of the column and of the row, distance from the
/// affine map of the neighbours [projector pixels]; −1 where there is none.
Image<float> uncertainty_picture(const PixelMap& map);

}  // namespace symrig
