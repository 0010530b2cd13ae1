// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <filesystem>
#include <optional>

namespace symrig {

/// The projector position that each camera pixel sees. A sequence of one axis gives that coordinate alone:
/// the other one is NaN in decoded pixels, with an infinite standard deviation. Such a map is no map of
/// places on the projector. Whatever needs both coordinates refuses it (require_both_axes).
struct PixelMap {
  Grid camera, projector;
  Image<float> col,
      row;  ///< projector position [px], camera grid; pixel j covers [j − ½, j + ½); 0 where mask is 0
  Image<std::uint8_t> mask;           ///< 1 = decoded
  Image<float> col_sigma, row_sigma;  ///< standard deviation of the position [px], where decoded
  Image<float> contrast;              ///< white − black, units of the photographs
  double noise = 0;                ///< rms of one photograph's pixel, estimated from all of them; same units
  CodeAxes axes = CodeAxes::both;  ///< the known coordinates
  double decoded_share() const;    ///< decoded / all camera pixels
};

/// fails: bad_value (a map of columns or rows alone). what: what needs both, "a registration".
Result<void> require_both_axes(const PixelMap& map, const char* what);

/// The constants of decoding, each with its reason. Most values were found on the 42 real photographs that
/// also measure the accuracy, and the reasons were written afterwards. So those figures are no independent
/// proof. `benchmark_pixel_map --sensitivity` shows the cost of half and twice each value.
struct DecodePolicy {
  /// A pixel is in shadow if white − black is below this many of its standard deviations. One shadow pixel in
  /// 700 passes.
  double contrast_sigmas = 3;
  /// The finest stripes must be visible around a pixel: their energy must exceed noise by this many standard
  /// deviations. One pixel without direct light in 30,000 passes.
  double direct_sigmas = 4;
  /// [px] A position with a larger standard deviation is rejected. At 0.75, two sigmas are the 1.5 pixels
  /// that make an outlier.
  double largest_sigma = 0.75;
  /// Any position elsewhere must fit worse by this χ²: a likelihood ratio of 20 : 1, 2 ln 20.
  double evidence = 6;
  /// No footprint is exactly a mixture of Gaussians, so differences are only known to this share of white −
  /// black. For an edge under a Gaussian of any sigma from 0.25 to 2.5 px, its two neighbours in the mixture
  /// err by at most 2.1 %. Real footprints are not Gaussians.
  double model_error = 0.03;
  /// Largest misfit of the best position, in sigmas of that error, rms over the bits.
  double largest_misfit = 4.5;
  /// Weight of the picture's footprint shape in the shape of a tile, in pixels.
  double tile_weight = 5;
  /// Standard deviation of the shares of a pixel's own footprint around those of its tile.
  double shape_spread = 0.15;
  /// This share of the decoded pixels within 3 pixels must predict the pixel's position,
  double support_share = 0.4;
  /// [px] within this distance. 1: the next stripe of the finest pattern belongs to another position.
  double support_distance = 1;
};

/// How to decode.
struct DecodeOptions {
  DecodePolicy policy = {};
  bool neighbours = true;  ///< reject positions that too few neighbours support
  bool smooth = false;  ///< replace positions by the plane of their neighbours' positions, fill small holes
  /// Refuse a sequence that contradicts itself: a wrong order, photographs of another scene, a wrong
  /// projector. If false, everything that decodes is used, right or wrong.
  bool check_sequence = true;
  bool mirrored = false;  ///< a rear projection: the map reverses orientation
  /// A pair that decoding must not use, because it is predicted later. Its bit is derived. Without Gray bit k
  /// a position is known up to a reflection inside its block of 2^(bits−k) pixels. Camera and projector see
  /// the same side of a surface, so the map keeps orientation. In blocks that are wide on the camera, only
  /// one of the two candidates does so. In narrow blocks (below 10 camera pixels) the blocks around predict
  /// the right one.
  std::optional<int> held_out_pair = {};
};

/// Decodes each pixel from its own photographs by maximum likelihood. It compares pattern minus complement of
/// every bit with what a footprint at x would see of the stripes. x may lie between pixels. The noise is
/// estimated from the photographs.
/// The footprint's width and tails are a mixture of Gaussians, which fits defocus, translucent matter and
/// reflections of other surfaces. Each 16 × 16 camera pixels share one footprint; a pixel that it does not
/// explain gets its own. Positions are never taken from neighbours unless `smooth` is set.
/// A pixel is decoded if all of this holds: it is lit; the finest stripes are visible around it (else it sees
/// indirect light only); its position is known well enough; no other position explains it nearly as well;
/// neighbours agree.
/// A sequence of one axis gives a map of that axis. A derived complement has the noise of three photographs.
/// error: col_sigma, row_sigma; rms 0.05 px on a plain surface. The stated deviations are scaled to the
/// scatter of the positions (stated_sigma.hpp). fails: bad_value (no pairs; no pixel has enough contrast;
/// most of the map runs backwards: a pair is swapped or out of order), bad_argument (no such held_out_pair,
/// or one of a single axis, whose bit cannot be derived), size_mismatch.
Result<PixelMap> decode(const CodePhotographs& photographs, const DecodeOptions& options = {});

/// read_gray_code_folder, then decode.
Result<PixelMap> decode_gray_code(const std::filesystem::path& folder, const ReadCodeOptions& reading = {},
                                  const DecodeOptions& decoding = {});

}  // namespace symrig
