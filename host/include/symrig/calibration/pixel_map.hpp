// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/gray_code.hpp"

#include <filesystem>
#include <optional>

namespace symrig {

/// Where on the projector each camera pixel looks.
struct PixelMap {
  Grid camera, projector;
  Image<float> col,
      row;  ///< projector position [px], camera grid; pixel j covers [j − ½, j + ½); 0 where mask is 0
  Image<std::uint8_t> mask;           ///< 1 = decoded
  Image<float> col_sigma, row_sigma;  ///< standard deviation of the position [px], where decoded
  Image<float> contrast;              ///< white − black, units of the photographs
  double noise = 0;              ///< rms of one photograph's pixel, estimated from all of them; same units
  double decoded_share() const;  ///< decoded / all camera pixels
};

/// What decoding takes as given, each with its reason. The reasons were written down after the values, most
/// of which were found on the 42 real photographs that the bars are measured on: those figures are no
/// independent proof. `bench_pixel_map --sensitivity` shows what half and twice of each cost.
struct DecodePolicy {
  /// Shadow: white − black below this many of its standard deviations. One shadow pixel in 700 passes.
  double contrast_sigmas = 3;
  /// Finest stripes must show around a pixel: their energy above noise by this many standard deviations. One
  /// pixel without direct light in 30,000 passes.
  double direct_sigmas = 4;
  /// [px] A position that is known no better than this is none: at 0.75, two sigmas are the 1.5 pixels that
  /// make an outlier.
  double largest_sigma = 0.75;
  /// χ² by which any position elsewhere must fit worse: a likelihood ratio of 20 : 1, 2 ln 20.
  double evidence = 6;
  /// No footprint is exactly a mixture of Gaussians: differences are known to this share of white − black
  /// only. An edge under a Gaussian of any sigma from 0.25 to 2.5 px is met by its two neighbours in the
  /// mixture to 2.1 % at the worst place, and footprints are no Gaussians.
  double model_error = 0.03;
  /// How many sigmas of that, rms over the bits, even the best position may miss by.
  double largest_misfit = 4.5;
  /// The shape of a footprint in a tile is drawn to the picture's as by this many pixels.
  double tile_weight = 5;
  /// Shares of a pixel's own footprint spread this much around its tile's.
  double shape_spread = 0.15;
  /// Of the decoded pixels within 3 of one this share must foretell its position,
  double support_share = 0.4;
  /// [px] to this. 1: the next stripe of the finest pattern is someone else's.
  double support_distance = 1;
};

/// How to decode.
struct DecodeOptions {
  DecodePolicy policy = {};
  bool neighbours = true;  ///< drop positions that few neighbours' agree with
  bool smooth = false;     ///< replace positions by the plane of their neighbours', fill small holes
  /// Refuse a sequence that contradicts itself: a wrong order, photographs of another scene, a wrong
  /// projector. Without it whatever decodes is decoded, rightly or wrongly.
  bool check_sequence = true;
  bool mirrored = false;  ///< a rear projection: the map turns orientation round
  /// A pair that must not be looked at, because it is to be predicted later. Its bit is derived: without Gray
  /// bit k a position is known up to a reflection inside its block of 2^(bits−k) pixels. In blocks that are
  /// wide on the camera only one of the two runs the right way, as camera and projector look at the same side
  /// of a surface and the map keeps orientation; in narrow ones (below 10 camera pixels) the blocks around
  /// foretell which it is.
  std::optional<int> held_out_pair = {};
};

/// Decodes each pixel from its own photographs by maximum likelihood: pattern less complement of every bit is
/// compared with what a footprint at x would see of the stripes, x between pixels included, against the noise
/// that the photographs themselves show. The footprint's width and tails (a mixture of Gaussians, so that
/// defocus, translucent matter and reflections of other surfaces all fit) are shared by 16 × 16 camera
/// pixels; a pixel that this does not explain gets its own. Positions are never taken from neighbours unless
/// `smooth` is set. A pixel is decoded if it is lit, the finest stripes show around it (else it sees indirect
/// light only), its position is known well enough, no other one explains it nearly as well, and neighbours
/// agree. error: col_sigma, row_sigma; rms 0.05 px on a plain surface. fails: bad_value (no pixel has enough
/// contrast; most of the map runs backwards: a pair is swapped or out of order), bad_argument (held_out_pair
/// is no pair), size_mismatch.
Result<PixelMap> decode(const CodePhotographs& photographs, const DecodeOptions& options = {});

/// read_gray_code_folder and decode in one.
Result<PixelMap> decode_gray_code(const std::filesystem::path& folder, const ReadCodeOptions& reading = {},
                                  const DecodeOptions& decoding = {});

}  // namespace symrig
