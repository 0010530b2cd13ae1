// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

namespace symrig {

/// A smooth model of a pixel map, piece by piece, and the edges between the pieces.
struct SmoothMap {
  Image<float> col, row;      ///< the projector position of the model [px], camera grid; 0 where not known
  Image<std::uint8_t> known;  ///< 1: decoded, and the model describes it
  Image<std::uint8_t> edges;  ///< 1: decoded, and no model describes it, or two pieces meet here
  int pieces = 0;
  int knots = 0;                           ///< distance of the splines' knots [camera pixels]
  double smoothing = 0;                    ///< cost of the fourth differences of the splines' coefficients
  double known_share = 0, edge_share = 0;  ///< of the decoded pixels

  /// How well a model of half of the pixels predicts the other half.
  struct HeldOut {
    double planar_share = 0;  ///< of the decoded left-out pixels: those on planar parts; these are judged
    double rms = 0;           ///< along an axis [px], of all judged pixels
    double far_share = 0;     ///< of the judged pixels: further away than kFar
  };
  static constexpr double kFar = 1.5;  ///< [px]
  HeldOut held_out;
};

/// Fits smooth surfaces to the decoded positions, two for each piece of the map: projector column and row.
///
///     min Σ (f(block) − position)² / variance + smoothing · (fourth differences of the spline's
///     coefficients)²
///
/// A block is the mean position of 4 × 4 camera pixels, weighted by the decoder's standard deviations. Its
/// variance is theirs and 0.11² [px²], for errors that neighbours share.
///
/// Pieces: at an edge, the planes through the blocks on both sides are half a projector pixel apart or more,
/// and more than five sigmas of their scatter. Blocks without an edge that touch are a piece, if there are
/// 100 of them. Fit: robust, by Tukey's biweight. Distance of knots and smoothing are those that predict
/// left-out blocks best. Edges: a block belongs to the piece within four blocks whose model is nearest. It
/// belongs to none if all are more than three sigmas away. Marked are groups of four such blocks or more, and
/// blocks where two pieces meet. By chance, 80,000 blocks have one such group in 2,000 maps.
///
/// Held out: every other block, like the black squares of a chessboard. Pieces, knots, smoothing and a model
/// of its own come from the others alone. Planar parts, too: no edge is within four blocks, and each
/// direction has neighbours enough to tell. So a pixel is not judged or left out because of its own error.
///
/// fails: bad_value (too few decoded pixels).
Result<SmoothMap> fit_smooth_map(const PixelMap& map);

}  // namespace symrig
