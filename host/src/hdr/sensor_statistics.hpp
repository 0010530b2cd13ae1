// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/internal/clipping.hpp"
#include "symrig/hdr/sensor.hpp"
#include "symrig/image/grid.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig::hdr {

/// Per-pixel mean and variance (n − 1) of frames.
struct PixelMoments {
  std::vector<double> mean, variance;
};
PixelMoments moments(std::span<const Codes> frames);

/// Mean over a window of 17 × 17 pixels without the flagged ones: the value under smooth light.
std::vector<double> smooth(std::span<const double> image, std::span<const std::uint8_t> left_out, Grid grid);

/// The same for the pixels of each colour of a 2 × 2 mosaic alone, if the means of the four places differ by
/// more than 2 %. Otherwise one window for all.
std::vector<double> smooth_by_colour(std::span<const double> image, std::span<const std::uint8_t> left_out,
                                     Grid grid);

/// One tile of a photon transfer curve.
struct TransferPoint {
  double mean = 0;      ///< code − pedestal
  double variance = 0;  ///< of one frame [DN²]
  double samples = 0;   ///< degrees of freedom
};

/// Straight line Var = offset + slope · mean with the variances of both.
struct TransferLine {
  double offset = 0, slope = 0;
  double offset_variance = 0, slope_variance = 0;

  /// True if the noise grows with the light, beyond doubt (five sigmas).
  bool rises() const { return slope > 0 && slope * slope >= 25 * slope_variance; }
};
/// Weighted least squares, the weights taken at the line itself and iterated.
TransferLine fit_transfer(std::span<const TransferPoint> points);

/// The variance of one frame, from the differences of the same pixels in two frames. They are corrected for
/// flicker and have no outliers. a, b: codes − pedestal of pixels whose light is about equal.
TransferPoint transfer_point(std::span<const double> a, std::span<const double> b);

/// Adds the tiles of the difference of two frames of one level (sensor.hpp), without flagged pixels.
void add_transfer_points(Codes a, Codes b, std::span<const std::uint8_t> left_out, Grid grid, double pedestal,
                         double saturation, std::vector<TransferPoint>& points);

// What the two ways to measure a sensor share.

/// Marks pixels whose dark level or dark noise differs from the others'. frames: how many `dark` is from.
void find_hot(const PixelMoments& dark, std::size_t frames, std::span<std::uint8_t> defects);

/// The mean of the pixels that are no defects; 0 if there are none.
double mean_of(std::span<const double> values, std::span<const std::uint8_t> defects);

/// √(squares / count − noise), at least 0.
double rms_beyond(double squares, double count, double noise);

/// The rms difference of the pixels' dark levels, without the part from temporal noise.
double dsnu_of(const PixelMoments& dark, std::span<const std::uint8_t> defects, std::size_t frames);

/// Sets the noise model of a sensor and its uncertainties from its transfer line.
void set_noise(Sensor& sensor, const TransferLine& line, int bits, double pedestal, int clipping);

}  // namespace symrig::hdr
