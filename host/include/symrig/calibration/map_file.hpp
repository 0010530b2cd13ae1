// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/pixel_map.hpp"

#include <filesystem>

namespace symrig {

/// The map as a picture for other programs. Its channels are projector column, projector row, decoded (1 or
/// 0), on the camera grid. A map of one axis has -1 in the channel of the other, where it is decoded.
Image<float> map_picture(const PixelMap& map);

/// Reads the map from such a picture. A channel that is -1 in every decoded pixel is not known. Uncertainty,
/// contrast and noise are not in it and stay empty. fails: bad_value (a decoded position is not on the
/// projector; names the first such pixel), bad_format (another number of channels, a third channel that is
/// neither 0 nor 1).
Result<PixelMap> map_of_picture(const Image<float>& picture, Grid projector, const std::string& name);

/// read_image, then map_of_picture, for a file of `symrig calibrate -o`.
Result<PixelMap> read_pixel_map(const std::filesystem::path& path, Grid projector);

}  // namespace symrig
