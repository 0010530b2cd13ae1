// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/exposure_ratio.hpp"
#include "symrig/image/radiance.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// What is known of the camera of a bracket; nothing: the folder's frames tell.
struct KnownCamera {
  std::optional<Sensor> sensor;
  std::optional<ResponseCurve> response;
  double response_doubt = 0;  ///< of a recovered curve: SensorFindings
};

/// Photographs to merge, and what is known of their camera.
struct BracketFolder {
  SensorPhotographs photographs;
  KnownCamera camera;
};

/// Reads a folder for merge_bracket. Of frames that a rig took of a scene (light = "scene"), the lit ones are
/// the bracket, and all of them measure the camera, unless `camera` says what it is.
/// fails: as read_sensor_folder; of a scene as measure_sensor_folder.
Result<BracketFolder> read_bracket_folder(const std::filesystem::path& folder, KnownCamera camera,
                                          const Progress& progress = {});

struct BracketOptions {
  /// Merges photographs that contradict their exposures or each other, too. The result may be wrong.
  bool unchecked = false;
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
/// Ratios that are wrong by a tenth altogether, and bands, are refused; less is a warning. Pixels that have
/// another light in two exposures, and those near them, are not valid, with a warning; many are refused.
/// A sensor that clips before it says so is merged as it clips, with a warning.
/// fails: bad_value (fewer than two exposures; a longer one that is not brighter; exposures that contradict
/// each other; no light at all; a sensor or curve of other bits), as examine_sensor and the merges.
Result<MergedBracket> merge_bracket(const SensorPhotographs& photographs, const KnownCamera& known,
                                    const BracketOptions& options = {});

}  // namespace symrig
