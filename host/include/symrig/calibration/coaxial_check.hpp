// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/base/result.hpp"

#include <cstdint>
#include <string>

namespace symrig {

/// A measured number and its standard deviation.
struct Estimate {
  double value = 0;
  double sigma = 0;

  /// |value| in sigmas.
  double significance() const;
};

/// The result for one axis of the picture.
struct AxisCheck {
  bool measured = false;  ///< false: fewer than four pixels along this axis, or too dark
  Estimate shift;         ///< [pixels] the camera sees at x what is at x + shift in the rig
  /// The shift is larger than largest_shift. `shift` is then only the place of most light, to a pixel.
  bool beyond = false;
  /// Share of the light that travels along this axis in one direction only, as in a one-sided flare.
  /// Positive: towards larger positions. sigma includes the unknown profile of the flare.
  Estimate flare;
  double flare_length = 0;        ///< [pixels] over which the flare falls to 1 / e, if there is one
  double flare_significance = 0;  ///< sigmas of the flare, without the uncertainty of its profile
  /// Share of the light in a second picture, and its offset; 0 if none was suspected.
  Estimate second;
  int second_shift = 0;  ///< [pixels]
};

struct CoaxialOptions {
  double sigmas = 5;  ///< a finding needs this significance, and more than the smallest value below
  double smallest_shift = 0.01;  ///< [pixels] a smaller misalignment adds less error than camera noise
  double smallest_flare = 1e-3;  ///< share of the light; a smaller flare adds less error than camera noise
  /// share of the light in a second picture; a smaller one adds less error than camera noise
  double smallest_second = 1e-3;
  Progress progress = {};  ///< of the photographs; may be empty
};

/// Whether camera and projector pixels coincide.
struct CoaxialCheck {
  static constexpr double largest_shift = 2.5;  ///< [pixels] the measured range

  AxisCheck rows, cols;
  /// Largest |qᵀ T p − pᵀ T q| of two patterns as a share of their direct light.
  Estimate reciprocity;
  std::int64_t photographs = 0;
  CoaxialOptions options;

  bool measured() const { return rows.measured || cols.measured; }
  bool misaligned() const;
  bool flaring() const;
  bool doubled() const;
  /// One line with the findings and the next step.
  std::string to_string() const;
};

/// Checks that T is symmetric before a capture relies on it [Garg06 §3: Helmholtz reciprocity holds on a
/// coaxial rig only].
/// On each axis it shows four combs p_i: thin stripes at distances 1 to 3 and one farther away, repeated over
/// the picture. For a symmetric T, p_jᵀ T p_i = p_iᵀ T p_j. This holds for any scene, with its
/// interreflections and its blur. So their difference shows the errors of camera and projector:
/// - Shift. A shift by m pixels moves direct light by m: Σ_{d ≤ 3} d · r(d) = −m. This is the first moment of
/// the differences r(d) at distance d, over the direct light of the stripes that it comes from. It is
/// measured up to ±2.5 pixels. If most light lies further from the stripes, the check reports that and
/// measures nothing else.
/// - Flare. A one-sided flare of share s and length l reaches the far stripes: r(d) = s (1 − k) k^d, k =
/// exp(−1/l), summed over the repeated stripes.
/// - Second picture of share s at an offset of g pixels, from two surfaces of a beam splitter, a filter or a
/// window. There is excess light g pixels from every stripe. One more photograph, of stripes at that place,
/// proves it: r(g) − r(g − 3) = s. It is found from 6 pixels to 6 less than the period (a quarter of the
/// axis), but not at half the period. A nearer one counts as a shift. A second picture that camera and
/// projector share leaves T symmetric, so it is not reported.
/// cost: 8 photographs (4 on a grid with one axis below four pixels), and one more for each axis with a
/// suspected second picture.
/// error: the stated sigmas contain camera noise, a quarter of the flare's part in the shift (its profile is
/// a guess), and a tenth of the shift (some of the light that it moves goes beyond three pixels, or over the
/// border). Other causes look like a one-sided flare: unequal focus, brightness that falls off towards the
/// border of one of the optics, and resampled pictures. to_string() lists them. A shift also moves indirect
/// light, which looks like a flare. So on a misaligned rig a flare is reported only if its share is above the
/// shift in pixels.
/// fails: as the probe; bad_value (NaN or infinity in a valid pixel).
Result<CoaxialCheck> check_coaxial(Probe& probe, const CoaxialOptions& options = {});

/// Stops a capture with a rig whose camera and projector pixels do not coincide.
/// fails: as check_coaxial; bad_value (CoaxialCheck::to_string(), if the rig is misaligned, flaring or
/// doubled).
Result<void> require_coaxial(Probe& probe, const CoaxialOptions& options = {});

}  // namespace symrig
