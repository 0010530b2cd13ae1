// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/photograph_noise.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::calibration {

/// Where the projector shines, whatever share of the picture that is, and what the photographs hold there.
/// Nothing here trusts white or black, nor any single photograph.
struct SequenceLight {
  const CodePhotographs& photographs;
  std::vector<int> pairs;           ///< all but the held-out one
  NoiseLine noise;                  ///< of one photograph's pixel
  Image<float> amplitude;           ///< rms of pattern less complement over the pairs; 0 where nothing is lit
  std::vector<std::size_t> sample;  ///< lit pixels
  double contrast = 0;              ///< rms of amplitude over the sample

  float of(int photograph, std::size_t pixel) const { return photographs.image(photograph).values()[pixel]; }
  /// Pattern less complement.
  float difference(int pair, std::size_t pixel) const {
    return of(2 * pair, pixel) - of(2 * pair + 1, pixel);
  }
  /// Pattern plus complement; of code.pairs(): white plus black.
  float sum(int pair, std::size_t pixel) const { return of(2 * pair, pixel) + of(2 * pair + 1, pixel); }
  /// Standard deviation of a photograph's pixel.
  double sigma(std::size_t pixel) const;
  const std::string& name(int photograph) const {
    return photographs.names[static_cast<std::size_t>(photograph)];
  }
};

/// A pixel is lit if patterns and complements differ in it by more than their noise: Σ (p − n)² over the
/// pairs eight standard deviations above that of noise alone.
SequenceLight find_sequence_light(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
