// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/probe.hpp"
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

/// What the check says of one axis of the picture.
struct AxisCheck {
  bool measured = false;  ///< false: fewer than four pixels along this axis, or too dark to tell
  Estimate shift;         ///< [pixels] the camera sees at x what the rig has at x + shift
  /// The shift is larger than largest_shift: `shift` then says only where most light lies, to a pixel.
  bool beyond = false;
  /// Share of the light that goes further along this axis than comes back, towards larger positions if
  /// positive, as a one-sided flare makes it; sigma includes that its profile is not known.
  Estimate flare;
  double flare_length = 0;        ///< [pixels] in which the flare falls to 1 / e, where one was found
  double flare_significance = 0;  ///< sigmas of the flare, its profile aside
  /// Share of the light in a second picture, and where that lies; 0 if nothing looked like one.
  Estimate second;
  int second_shift = 0;  ///< [pixels]
};

struct CoaxialOptions {
  double sigmas = 5;             ///< an alarm needs this significance, and more than the smallest value below
  double smallest_shift = 0.01;  ///< [pixels] below it, misalignment costs less than camera noise
  double smallest_flare = 1e-3;  ///< share of the light; the same
  double smallest_second = 1e-3;  ///< share of the light in a second picture; the same
};

/// Whether camera and projector share their pixels.
struct CoaxialCheck {
  static constexpr double largest_shift = 2.5;  ///< [pixels] what is measured; beyond it light gets lost

  AxisCheck rows, cols;
  /// Largest |qᵀ T p − pᵀ T q| of two patterns as a share of their direct light.
  Estimate reciprocity;
  std::int64_t photographs = 0;
  CoaxialOptions options;

  bool measured() const { return rows.measured || cols.measured; }
  bool misaligned() const;
  bool flaring() const;
  bool doubled() const;
  /// One line that names what was found and what to do.
  std::string to_string() const;
};

/// Looks whether T is symmetric before a capture relies on it [Garg06 §3: Helmholtz reciprocity holds on a
/// coaxial rig only]. On each axis four combs p_i are shown, thin stripes at distances 1 to 3 and one farther
/// off, repeated over the picture. For a symmetric T, p_jᵀ T p_i = p_iᵀ T p_j, whatever the scene, its
/// interreflections and its blur; so their difference shows what camera or projector add:
///   - a shift by m pixels moves direct light by m: Σ_{d ≤ 3} d · r(d) = −m, the first moment of the
///     differences r(d) at distance d over the direct light of the stripes that it comes from; measured to
///   ±2.5 pixels. Where most light lies further from the stripes, the check says so, and measures nothing
///   else;
///   - a one-sided flare of share s and length l reaches the far stripes: r(d) = s (1 − k) k^d, k =
///   exp(−1/l),
///     summed over the repeated stripes.
///   - a second picture of share s, g pixels off (two surfaces of a beam splitter, a filter, a window): light
///     stands out g pixels from every stripe. One more photograph, of stripes there, proves it:
///     r(g) − r(g − 3) = s. Seen from 6 pixels to 6 less than the period (a quarter of the axis), but not at
///     half of it; nearer it counts as a shift. A second picture that camera and projector share leaves T
///     symmetric, and is none.
/// cost: 8 photographs (4 on a grid with one axis below four pixels), and one an axis where something looks
/// like a second picture. error: the stated sigmas hold camera
/// noise, a quarter of the flare's part in the shift (its profile is a guess), and a tenth of the shift (some
/// of the light that it moves goes beyond three pixels, or over the border). A one-sided flare is not the
/// only cause of an asymmetry: unequal focus, brightness that falls off towards the border of one of the
/// optics, and resampled pictures look so, too; to_string() lists them. A shift moves indirect light too,
/// which looks like a flare: on a misaligned rig a flare is named only if its share is above the shift in
/// pixels. fails: whatever the probe fails with, bad_value (NaN or infinity in a valid pixel).
Result<CoaxialCheck> check_coaxial(Probe& probe, const CoaxialOptions& options = {});

/// Stops before a rig whose camera and projector do not share their pixels wastes a capture.
/// fails: as check_coaxial; bad_value (CoaxialCheck::to_string(), if the rig is misaligned, flaring or
/// doubled).
Result<void> require_coaxial(Probe& probe, const CoaxialOptions& options = {});

}  // namespace symrig
