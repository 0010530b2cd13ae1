// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/exposure_ratio.hpp"
#include "symrig/image/radiance.hpp"

#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// What is known of the camera of a bracket; nothing: the folder's frames tell.
struct KnownCamera {
  std::optional<Sensor> sensor;
  std::optional<ResponseCurve> response;
};

/// A bracket of photographs as radiance.
struct MergedBracket {
  Radiance radiance;
  const char* units = "";  ///< of radiance
  SensorFindings camera;   ///< what it was merged with
  std::vector<ExposureRatio> ratios;
  std::vector<std::string> warnings;  ///< what contradicts what, a sentence each
};

/// Merges `bracket`. A linear camera, by `known` or by the folder's dark and flat frames: merge weights of
/// MergeStream, electrons per second. Otherwise by a response curve, known or recovered from the bracket
/// (merge_by_response). Stated exposures are compared with those that pixels see.
/// fails: bad_value (fewer than two exposures; a sensor or curve of other bits), as examine_sensor and the
/// merges.
Result<MergedBracket> merge_bracket(const SensorPhotographs& photographs, const KnownCamera& known);

}  // namespace symrig
