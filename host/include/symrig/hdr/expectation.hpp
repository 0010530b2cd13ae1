// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

namespace symrig {

/// How many pixels (in all channels) have about one radiance.
struct ExpectedLight {
  double radiance = 0;
  double pixels = 0;
};

/// Some pixels of a photograph, such as those that are lit, and how well they must be known together.
struct ExpectedPart {
  std::vector<ExpectedLight> lights;
  /// Mean square noise of these pixels that is good enough [radiance²]. Errors of a transport are norms: what
  /// counts is the sum of squares, not the worst pixel.
  double noise = 0;
};

/// What a photograph is expected to show and how well it must be known, told before it is taken, so that a
/// rig can choose its exposures. Radiance per unit of projector light.
struct Expectation {
  std::vector<ExpectedPart> parts;
  /// The longest that the exposures of this photograph may take together [s]; what is wanted gives way to it.
  double longest_seconds = 10;
};

/// A histogram of radiances, four bins an octave from 2⁻⁶⁰ to 2²⁰; what is darker counts as 0.
class LightHistogram {
 public:
  LightHistogram() : counts_(kBins) {}

  void add(float radiance) { counts_[bin_of(radiance)] += 1; }
  void add(float radiance, double pixels) { counts_[bin_of(radiance)] += pixels; }
  void add(const LightHistogram& other);
  double pixels() const;
  double mean_square() const;
  /// Each bin with pixels, by its upper end.
  std::vector<ExpectedLight> lights() const;

 private:
  static constexpr std::size_t kBins = 4 * 80 + 1;
  static std::size_t bin_of(float radiance);
  static double upper_end(std::size_t bin);

  std::vector<double> counts_;
};

}  // namespace symrig
