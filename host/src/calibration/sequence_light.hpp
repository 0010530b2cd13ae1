// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/photograph_noise.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::calibration {

/// The pixels that the projector lights, and their values in the photographs. Nothing here trusts white or
/// black, or any single photograph.
struct SequenceLight {
  const CodePhotographs& photographs;
  std::vector<int> pairs;  ///< all but the held-out one
  NoiseLine noise;         ///< of one photograph's pixel
  Image<float> amplitude;  ///< rms of pattern minus complement over the pairs; 0 where nothing is lit
  std::vector<std::size_t> sample;  ///< lit pixels
  double contrast = 0;              ///< rms of amplitude over the sample

  float of(int photograph, std::size_t pixel) const { return photographs.image(photograph).values()[pixel]; }
  /// Pattern minus complement.
  float difference(int pair, std::size_t pixel) const {
    return of(2 * pair, pixel) - of(2 * pair + 1, pixel);
  }
  /// Pattern plus complement; white plus black for pair = code.pairs().
  float sum(int pair, std::size_t pixel) const { return of(2 * pair, pixel) + of(2 * pair + 1, pixel); }
  /// Standard deviation of a photograph's pixel.
  double sigma(std::size_t pixel) const;
  /// Standard deviation of `difference`.
  double difference_sigma(std::size_t pixel) const;
  const std::string& name(int photograph) const { return photographs.names[photograph]; }
};

/// A pixel is lit if its patterns and complements differ by more than noise. The limit: Σ (p − n)² over the
/// pairs is eight standard deviations above that of noise alone.
SequenceLight find_sequence_light(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
