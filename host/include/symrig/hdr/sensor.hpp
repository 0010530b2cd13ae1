// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/noise_model.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <filesystem>
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

}  // namespace symrig
