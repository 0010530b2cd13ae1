// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/merge.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
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
  std::optional<ResponseCurve> response;  ///< unless the bracket proves the measured sensor linear
  /// Without dark and flat frames: the camera, if the bracket alone shows a straight line
  /// (RecoveredResponse).
  std::optional<NoiseModel> straight;
  /// Largest difference from [Robertson99], as a share of full light: the uncertainty of the method.
  double response_doubt = 0;
  std::optional<SceneFacts> scene;  ///< if the frames are of a scene

  /// A recovered curve is known to about 5 %: the codes next to clipping, which nothing samples, decide its
  /// scale. Where two methods differ by more, exposures are so far apart that they leave the curve open, or
  /// what both methods assume does not hold: stated exposures, a still scene, steady light.
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

/// Writes the frames of a sensor's measurement to a folder, with the capture.toml that measures the same
/// again (measure_sensor_folder). That file comes last, so a record that was stopped is none.
class SensorRecord {
 public:
  /// Its first level makes the folder, if only it is missing.
  /// fails: bad_argument (the folder has a capture.toml, which may describe other photographs).
  static Result<SensorRecord> make(std::filesystem::path folder, Grid grid, int bits);

  /// As SceneTransfer::begin() and add(). fails: io, and as write_file_atomically().
  Result<void> begin(const SceneLevel& level);
  Result<void> add(std::span<const std::uint16_t> first, std::span<const std::uint16_t> second);
  Result<void> finish();

 private:
  SensorRecord(std::filesystem::path folder, std::string head)
      : folder_(std::move(folder)), text_(std::move(head)) {}
  Result<void> add(std::span<const std::uint16_t> codes);
  void end_level();

  std::filesystem::path folder_;
  std::string text_;   // of capture.toml
  std::string files_;  // of the level
  std::string name_;   // "lit3"
  int levels_ = 0, frames_ = 0;
};

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
  const char* units = "";             ///< of radiance
  SensorFindings camera;              ///< what it was merged with
  std::vector<double> code_variance;  ///< of each code, by a response curve only: ResponseMerge
  int saturation = 0;                 ///< codes from it on do not count
  std::vector<ExposureRatio> ratios;
  std::vector<std::string> warnings;  ///< what contradicts what, a sentence each
};

/// Merges `bracket`. A linear camera, by `known` or by the folder's dark and flat frames: merge weights of
/// MergeStream, electrons per second; by the bracket alone, in units of the largest code's light per second.
/// Otherwise by a response curve, known or recovered from the bracket (merge_by_response). Stated exposures
/// are compared with those that pixels see. Ratios that are wrong by a tenth altogether, and bands, are
/// refused; less is a warning. Pixels that have another light in two exposures, and those near them, are not
/// valid, with a warning; many are refused. A sensor that clips before it says so is merged as it clips, with
/// a warning. fails: bad_value (fewer than two exposures; a longer one that is not brighter; exposures that
/// contradict each other; no light at all; a sensor or curve of other bits), as examine_sensor and the
/// merges.
Result<MergedBracket> merge_bracket(const SensorPhotographs& photographs, const KnownCamera& known,
                                    const BracketOptions& options = {});

}  // namespace symrig
