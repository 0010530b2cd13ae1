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
  Image<std::uint8_t> mask;      ///< 1 = decoded
  Image<float> contrast;         ///< white − black, units of the photographs
  double noise = 0;              ///< rms of one photograph's pixel, estimated from all of them; same units
  double decoded_share() const;  ///< decoded / all camera pixels
};

/// When a pixel is decoded. σ is PixelMap::noise.
struct DecodeOptions {
  double contrast_sigmas = 3;    ///< shadow: white − black below this many √2 σ
  double margin_sigmas = 2;      ///< ambiguous bit: |pattern − complement| below this many √2 σ,
  double margin_fraction = 0.1;  ///< or below this share of white − black
  bool subpixel = true;   ///< fit a plane to the neighbourhood: positions between pixels, small holes filled
  bool mirrored = false;  ///< a rear projection: the map turns orientation round
  /// A pair that must not be looked at, because it is to be predicted later. Its bit is derived: without Gray
  /// bit k a position is known up to a reflection inside its block of 2^(bits−k) pixels; of the two
  /// candidates only one runs the right way, as camera and projector look at the same side of a surface and
  /// the map keeps orientation. Needs blocks wider than about 20 camera pixels.
  std::optional<int> held_out_pair = {};
};

/// Decodes by comparing each pattern with its complement. A bit that is ambiguous is accepted where it may
/// be: on an edge between two neighbouring positions, which then becomes the position ½ between them. error:
/// ± ½ projector pixel without subpixel; with it about 0.1 px on a smooth surface. fails: bad_value (no pixel
/// has enough contrast; most of the map runs backwards: a pair is swapped or out of order), bad_argument
/// (held_out_pair is no pair), size_mismatch.
Result<PixelMap> decode(const CodePhotographs& photographs, const DecodeOptions& options = {});

/// read_gray_code_folder and decode in one.
Result<PixelMap> decode_gray_code(const std::filesystem::path& folder, const ReadCodeOptions& reading = {},
                                  const DecodeOptions& decoding = {});

}  // namespace symrig
