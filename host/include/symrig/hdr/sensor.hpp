// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/hdr/response.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// The measured properties of one camera's sensor: the sensor.toml of a rig file.
struct Sensor {
  NoiseModel noise = NoiseModel::from_electrons({});
  double gain_sigma = 0;        ///< relative error of noise.gain(), one sigma
  double read_noise_sigma = 0;  ///< relative error of noise.read_noise(), one sigma
  double prnu = 0;  ///< rms of the pixels' sensitivities, relative to their neighbours'; 0: not measured
  double dsnu = 0;  ///< rms of the pixels' dark levels [DN]
  double nonlinearity = 0;     ///< largest departure from a straight line, share of full scale; 0: not tested
  bool clipping_seen = false;  ///< frames clip; else noise.clipping_code() is assumed to be the largest code
  Image<std::uint8_t> defects;  ///< 1 = hot, dead, stuck or noisy; empty: not measured

  std::string to_string() const;
};

/// Frames for the measurement of a sensor: raw codes, raster order, one plane.
struct SensorFrames {
  Grid grid;
  int bits = 12;
  /// With the lens capped, at one exposure. At least two; four or more to separate DSNU from noise.
  std::vector<std::span<const std::uint16_t>> dark;
  /// A light that is smooth over 32 pixels, two or more frames for each level. Only differences within a
  /// level count, so a lamp that flickers between frames has no effect. Use levels from a tenth of the range
  /// upwards; five are enough.
  std::vector<std::vector<std::span<const std::uint16_t>>> flat;
};

/// Photon transfer [Janesick07]. Tiles of 32 × 32 pixels; within each, of two frames of one level,
///   Var[code] = Σ (a − b/q − mean)² / ((n − 1)(1 + 1/q)),   q = Σb / Σa (flicker),
/// against the mean code minus the pedestal is a straight line (NoiseModel::VarianceLine), fitted with
/// weights 1 / Var[Var] = n / (2 Var²), iterated. Dark frames are its point at 0. Defects are found first and
/// not used. Flat frames that clip, or parts of them, tell the clipping code; else it is assumed to be the
/// largest. error: gain √(2/n) · 1.5, read noise √(1/(2 n_dark)) + gain's, n: samples of differences
/// (frames_needed()). fails: bad_argument (fewer than two dark frames or two of a level, bits),
/// size_mismatch, bad_value (no level between dark and saturation; or the variance does not grow with light,
/// because the frames are processed and not raw).
Result<Sensor> measure_sensor(const SensorFrames& frames);

/// The number of frames for given relative errors (one sigma) of gain and read noise: pairs of one flat
/// level, and dark frames, both at least 2. Derived from Var[s²]/s⁴ = 2/n for a difference of two frames.
struct FramesNeeded {
  int flat_pairs = 1;
  int dark = 2;
};
FramesNeeded frames_needed(std::int64_t pixels, double gain_error, double read_noise_error);

/// A TOML table [sensor] (docs/sensor.md). Written atomically.  fails: io, not_found.
Result<void> save_sensor(const std::filesystem::path& path, const Sensor& sensor);
/// fails: not_found, io, bad_format (file:line, key, legal values).
Result<Sensor> load_sensor(const std::filesystem::path& path);

/// One light and one exposure of a still scene.
struct SceneLevel {
  bool lit = false;  ///< false: the projector is black, or the lens is capped
  Nanoseconds exposure{0};
};

/// What frames of a still scene tell besides the sensor.
struct SceneFacts {
  /// Dark current and stray light, mean of all pixels [DN/s]; 0: one dark level only.
  double dark_signal = 0;
  double dark_signal_sigma = 0;  ///< its standard error
  double drift = 0;              ///< the light at the end by that at the begin, less 1
  double flicker = 0;            ///< rms change of the light from frame to frame, share
  bool clipping_seen = false;    ///< false: no level saturates, and the largest code is taken for it
  Grid grid;
  std::int64_t dark_frames = 0, lit_frames = 0;
  int dark_levels = 0, lit_levels = 0;
};

/// A sensor that was measured with a still scene.
struct SceneSensor : SceneFacts {
  /// prnu is 0, and defects are those of dark frames: the scene is no even light. Empty: the noise does not
  /// grow with light, because the camera is not linear.
  std::optional<Sensor> sensor;
  Linearity linearity;
  std::optional<ResponseCurve> response;  ///< [Debevec97], unless the camera is linear
  double response_doubt = 0;              ///< largest difference from [Robertson99], share of full light
};

/// Measures a sensor from pairs of frames of any still scene in steady light. Frames pass through: memory is
/// about 20 bytes for each pixel, and one frame for each lit exposure.
///
/// The difference of two frames of one pixel has twice the variance of one frame, whatever the scene is. So
/// the scene need not be even. The first lit pair sorts the pixels into groups whose light differs by a
/// quarter at most. It is not used otherwise, because a choice by a frame's own noise would bias its
/// variance. Each later pair gives a point (mean, variance) for each group, and the line through all points
/// is that of measure_sensor [Janesick07]. The pedestal is that of dark frames, continued to an exposure of
/// 0. Pixels whose light is expected to be beyond the range show the code at which light clips.
///
/// Exposures are needed for the linearity, for the dark signal and for clipping. A scene does not tell how
/// the sensitivities of pixels differ (PRNU), or which pixels see no light.
class SceneTransfer {
 public:
  using Codes = std::span<const std::uint16_t>;

  SceneTransfer(Grid grid, int bits);
  ~SceneTransfer();
  SceneTransfer(SceneTransfer&&) noexcept;
  SceneTransfer& operator=(SceneTransfer&&) noexcept;

  /// The level of the pairs that follow. Dark levels come first, the shortest exposure before the others. The
  /// first lit level must be bright and mostly unsaturated. If a later one has the same exposure within 1 %,
  /// it tells the drift of the light.
  /// fails: bad_argument (order, exposure).
  Result<void> begin(const SceneLevel& level);
  /// Two frames, one directly after the other.
  /// fails: bad_argument (no level was begun), size_mismatch, bad_value (a code of more bits).
  Result<void> add(Codes first, Codes second);

  /// fails: bad_argument (no dark level of four frames, no lit level of two), limit (the light drifts by more
  /// than kMostDrift), bad_value (no light between dark and saturation; noise that does not grow with light;
  /// no two exposures to compare).
  Result<SceneSensor> finish();

  /// The light may change by this share: half of what would make a linear camera look wrong.
  static constexpr double kMostDrift = 0.02;

 private:
  struct Inside;
  std::unique_ptr<Inside> inside_;
};

}  // namespace symrig
