// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace symrig {

/// The number of pixels (in all channels) with about the same radiance.
struct ExpectedLight {
  double radiance = 0;
  double pixels = 0;
};

/// A part of the pixels of a photograph, such as the lit ones, and its wanted noise.
struct ExpectedPart {
  std::vector<ExpectedLight> lights;
  /// The wanted mean square noise of these pixels [radiance²]. Errors of a transport are norms, so the sum of
  /// squares counts, not the worst pixel.
  double noise = 0;
};

/// The expected light of a photograph and its wanted noise. A rig uses it to choose the exposures. Radiance
/// per unit of projector light.
struct Expectation {
  /// None: the first look at the flood-lit scene. Nothing but the rig's own metering foresees it.
  std::vector<ExpectedPart> parts;
  /// The longest allowed sum of the exposures of this photograph [s]. It has priority over the wanted noise.
  double longest_seconds = 10;
  /// Steps by which a budget of seconds has raised the wanted noise. A log keeps them: a capture with another
  /// budget wants another photograph of the same pattern.
  std::int32_t coarser_steps = 0;
};

/// A histogram of radiances, four bins an octave from 2⁻⁶⁰ to 2²⁰; darker values count as 0.
class LightHistogram {
 public:
  LightHistogram() : counts_(kBins) {}

  void add(float radiance) { counts_[bin_of(radiance)] += 1; }
  void add(float radiance, double pixels) { counts_[bin_of(radiance)] += pixels; }
  void add(const LightHistogram& other);
  double pixels() const;
  double mean_square() const;
  /// The bins with pixels. A bin's radiance is its upper end.
  std::vector<ExpectedLight> lights() const;

 private:
  static constexpr std::size_t kBins = 4 * 80 + 1;
  static std::size_t bin_of(float radiance);
  static double upper_end(std::size_t bin);

  std::vector<double> counts_;
};

}  // namespace symrig
