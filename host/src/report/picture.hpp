// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Pictures for viewing: numbers become 8-bit colours here. No computation uses these colours.

namespace symrig::report {

using Rgb = std::array<std::uint8_t, 3>;

/// 8-bit sRGB picture of three channels.
using Picture = Image<std::uint8_t>;

/// The radiance that is shown as white: the value that `share` of the finite values do not exceed; 0 if none
/// is positive.
float white_level(const Image<float>& image, double share = 0.995);

/// Linear radiance as an sRGB picture [IEC 61966-2-1]; radiance `white` becomes white. 3 channels: colour;
/// else the first channel as grey.
Picture photograph(const Image<float>& image, float white);
/// The same with a horizontal red line [Garg06 Fig. 2b]. height: position from 0 (top) to 1. The line is one
/// row high, or more in large pictures so that it is visible.
Picture photograph_with_line(const Image<float>& image, float white, double height);

/// Mean over channels of |a − b|, one channel. Grids and channels must be equal.
Image<float> difference(const Image<float>& a, const Image<float>& b);

/// One channel in false colour from 0 (dark) to `top` (bright).
Picture false_colour(const Image<float>& image, float top);
/// One channel in false colour on a logarithmic scale from top · 10^-decades (dark, also for smaller values)
/// to top.
Picture log_colour(const Image<float>& image, float top, int decades);
/// Levels of the hierarchy in grey: darker is deeper, −1 (nothing stored) is a dark red [Garg06 Fig. 2d].
Picture level_greys(const Image<float>& levels, int deepest);
/// The colours of false_colour and log_colour from 0 to 1, for a scale beside the picture.
Rgb colour_of(double share);
Rgb level_grey(int level, int deepest);

/// The picture, reduced by averaging until its longer side is at most `side`.
Image<float> shrunk(const Image<float>& image, int side);

/// [RFC 4648 §4]
std::string base64(std::span<const std::uint8_t> bytes);

/// `data:image/png;base64,…`.
std::string data_uri(const Picture& picture);

/// How finely the transport of each pixel is divided, on the camera's grid.
struct PixelDepth {
  /// Mean level of the leaves (including empty ones) in the pixel's row of T, over their entries.
  Image<float> level;
  /// Number of terms of the pixel's row of T: products of two pictures, single entries, entries of bands.
  Image<float> terms;
};

/// needs: a symmetric tensor.
PixelDepth pixel_depth(const TransportTensor& tensor);

}  // namespace symrig::report
