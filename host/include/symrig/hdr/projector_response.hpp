// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/response.hpp"

#include <filesystem>
#include <span>
#include <vector>

namespace symrig {

/// Light that a projector gave at one of its levels, as photographed: mean over its pixels and its variance.
struct FieldLight {
  int level = 0;  ///< what was sent, 0 … largest
  double light = 0, variance = 0;
};

/// How a projector turns levels into light, black level apart. Binary patterns, the default, need none of it.
class ProjectorResponse {
 public:
  /// Weighted isotonic fit to photographs of even fields, any number of them, in any order; at least black
  /// and white and three between. Levels that were not photographed lie on straight lines between those that
  /// were. largest: white, such as 255. fails: bad_argument (levels out of range, too few), bad_value (no
  /// more light at white than at black; a level darker than a lower one by more than 5 σ: the lamp changed
  /// meanwhile).
  static Result<ProjectorResponse> fit(std::span<const FieldLight> levels, int largest = 255);

  /// Light of a level as a share of white's, black taken off: 0 … 1, never falling.
  double light(int level) const { return curve_.light[static_cast<std::size_t>(level)]; }
  /// How far the nearest level may be from a light: half the largest step, as a share of white.
  double resolution() const;
  const ResponseCurve& curve() const { return curve_; }

 private:
  ResponseCurve curve_;
};

/// A TOML table [levels] (docs/levels.md): the light of each level. Written atomically.  fails: io,
/// not_found.
Result<void> save_projector_response(const std::filesystem::path& path, const ProjectorResponse& response);
/// The light of the 256 levels from 0 to 1, never falling: what CodeTable::from_light takes.
/// fails: not_found, io, bad_format (file:line, what is legal).
Result<std::vector<double>> load_projector_light(const std::filesystem::path& path);

}  // namespace symrig
