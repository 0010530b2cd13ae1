// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/response.hpp"

#include <filesystem>
#include <span>
#include <vector>

namespace symrig {

/// The photographed light of a projector at one of its levels: mean over its pixels, and variance of the
/// mean.
struct FieldLight {
  int level = 0;  ///< the level that was sent, 0 … largest
  double light = 0, variance = 0;
};

/// How a projector turns levels into light, without the black level. Binary patterns, the default, do not
/// need it.
class ProjectorResponse {
 public:
  /// Weighted isotonic fit to photographs of even fields in any number and order: at least black, white and
  /// three levels between. Levels without a photograph are interpolated linearly. largest: white, such as
  /// 255. fails: bad_argument (levels out of range, too few), bad_value (white is not brighter than black; or
  /// a level is darker than a lower one by more than 5 σ, because the lamp changed meanwhile).
  static Result<ProjectorResponse> fit(std::span<const FieldLight> levels, int largest = 255);

  /// Light of a level, minus black, as a share of white's: 0 … 1, never falling.
  double light(int level) const { return curve_.light[level]; }
  /// The largest difference of a light from its nearest level: half the largest step, as a share of white.
  double resolution() const;
  const ResponseCurve& curve() const { return curve_; }

 private:
  ResponseCurve curve_;
};

/// A TOML table [levels] (docs/levels.md): the light of each level. Written atomically.  fails: io,
/// not_found.
Result<void> save_projector_response(const std::filesystem::path& path, const ProjectorResponse& response);
/// The light of the 256 levels from 0 to 1, never falling: the input of CodeTable::from_light.
/// fails: not_found, io, bad_format (file:line, legal values).
Result<std::vector<double>> load_projector_light(const std::filesystem::path& path);

}  // namespace symrig
