// SPDX-License-Identifier: Apache-2.0
// The code at which a camera clips, which may be below the largest one.
#pragma once

#include "symrig/hdr/merge.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace symrig::hdr {

using Codes = std::span<const std::uint16_t>;

/// The lower end of the values, if a share of them is within `within` of one value. nullopt also for fewer
/// than 50.
std::optional<double> piled_up(std::vector<double> values, double within, double share);

/// The code that 50 samples reach, or one in two thousand if these are more: stuck pixels may be brighter.
int brightest(Codes codes);

/// How the codes of a linear camera are read: codes − pedestal are proportional to light, with this noise in
/// the dark.
struct LinearCodes {
  double pedestal = 0;
  double read_noise = 0;  ///< [DN]
};

/// The code at which longer exposures stay, although the next shorter one expects more: by 2 % with a linear
/// camera, whose light has noise there. codes: nullopt for a camera that may be curved; then the code at
/// which longer exposures stay while the next shorter one rises by a tenth of it, less five deviations of the
/// codes there. nullopt: no exposure clips. error: up to five read noises low.
std::optional<int> clipping_of_bracket(std::span<const Frame> frames,
                                       const std::optional<LinearCodes>& codes);

/// The code at which a part of a flat frame stands: the window of its brightest codes has four times the
/// samples of any of four windows below. Light without clipping makes the windows below fuller.
std::optional<int> clipping_of_flat(Codes codes, double dark_noise);

/// How often each code occurs in dark frames.
class DarkCodes {
 public:
  void add(Codes codes);
  /// The share of the samples that were below code 0 before they were cut: of a normal distribution with the
  /// median and the upper spread of the codes. 0 if the noise is below 0.6 codes, where rounding hides it.
  double cut_share() const;
  /// fails: bad_value (more than 2 % are cut: pedestal and read noise would be wrong).
  Result<void> check() const;

 private:
  double quantile(double share) const;

  std::vector<double> count_ = std::vector<double>(std::size_t{1} << 16);
  double all_ = 0;
};

}  // namespace symrig::hdr
