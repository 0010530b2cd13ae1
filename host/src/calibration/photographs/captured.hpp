// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/calibration/capture_file.hpp"
#include "symrig/calibration/gray_code.hpp"
#include "symrig/image/image.hpp"

#include <filesystem>
#include <numeric>
#include <vector>

namespace symrig::calibration {

/// One picture of a capture folder.
struct Captured {
  Image<float> light;    ///< one channel: read_captured()
  Image<float> peak;     ///< the brightest channel of a picture in colours; empty: light
  float saturation = 1;  ///< the value of a saturated pixel; infinity: the file holds light, not codes

  const Image<float>& brightest() const { return peak.empty() ? light : peak; }
};

/// fails: as read_captured; bad_value (a code that does not fit in the bits of [sensor]).
Result<Captured> read_captured_codes(const std::filesystem::path& file, const CaptureFile& capture);

/// The value at which pixels of the longer exposure stay: the largest code of fewer bits, if one in 200
/// stands there; or any value, although the shorter one expects more by 30 %. ratio: of the exposures.
std::optional<float> value_that_light_piles_up_at(const Captured& shorter, const Captured& longer,
                                                  double ratio, double pedestal);

/// The numbers of photographs that a projector's sequence may have, the complete one first: with or without
/// complements, of both axes or of columns alone.
std::vector<int> legal_lengths(Grid projector);

/// Puts the derived complements between patterns: white + black − pattern.
/// images, names: the patterns, then white, then black.
CodePhotographs with_derived_complements(const GrayCode& code, std::vector<Image<float>> images,
                                         std::vector<std::string> names);

/// The mean of all values.
inline double mean_light(const Image<float>& image) {
  const auto values = image.values();
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

}  // namespace symrig::calibration
