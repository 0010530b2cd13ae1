// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/hdr/scene_sensor.hpp"
#include "symrig/hdr/sensor.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace symrig {

/// The frames that `[sensor]` of a capture.toml names, as codes (docs/sensor.md).
struct SensorPhotographs {
  using Codes = std::vector<std::uint16_t>;
  struct Still {
    Codes codes;
    Nanoseconds exposure{0};
    std::string file;  ///< its name in the folder
  };

  Grid grid;
  int channels = 1;  ///< of each frame; the planes of its codes follow each other
  int bits = 0;
  std::vector<Codes> dark;               ///< lens capped
  std::vector<std::vector<Codes>> flat;  ///< by level
  std::vector<Still> bracket;            ///< of one still scene in steady light
  bool scene = false;                    ///< light = "scene": frames that a rig took to measure its camera
};

/// Of frames of a scene, the lit ones are the bracket, level by level; the dark ones are not read.
/// fails: as read_capture_file and read_captured; bad_value (no [sensor], unknown number of bits, a code that
/// exceeds them), size_mismatch, interrupted.
Result<SensorPhotographs> read_sensor_folder(const std::filesystem::path& folder,
                                             const Progress& progress = {});

/// The results for the sensor.
struct SensorFindings {
  std::optional<Sensor> sensor;           ///< from dark and flat frames
  std::optional<Linearity> linearity;     ///< from the bracket, if the sensor is measured
  std::optional<ResponseCurve> response;  ///< [Debevec97], unless the bracket proves the camera linear
  /// Largest difference from [Robertson99], as a share of full light: the uncertainty of the method.
  double response_doubt = 0;
  std::optional<SceneFacts> scene;  ///< if the frames are of a scene

  /// A recovered curve is known to about 5 %: the codes next to clipping, which nothing samples, decide its
  /// scale. Where two methods differ by more, what both assume does not hold: stated exposures, a still
  /// scene, steady light.
  static constexpr double kMostDoubt = 0.05;
  bool doubtful() const { return response && response_doubt > kMostDoubt; }
};

/// fails: bad_value (neither dark and flat frames nor a bracket; colour frames of a sensor; a longer exposure
/// that is not brighter), as measure_sensor, test_linearity and recover_response.
Result<SensorFindings> examine_sensor(const SensorPhotographs& photographs);

/// The measurement of a sensor, and what it was made from.
struct MeasuredSensor {
  SensorFindings findings;
  Grid grid;
  std::int64_t dark_frames = 0, flat_levels = 0, bracket = 0;
};

/// fails: as SceneTransfer::finish().
Result<MeasuredSensor> examine_scene(SceneTransfer& transfer);

/// Measures the sensor from a folder, with an even light or a scene. Frames of a scene are read one after the
/// other. fails: as read_sensor_folder, examine_sensor and SceneTransfer.
Result<MeasuredSensor> measure_sensor_folder(const std::filesystem::path& folder,
                                             const Progress& progress = {});

}  // namespace symrig
