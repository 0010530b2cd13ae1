// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/sequence/photograph_noise.hpp"
#include "symrig/calibration/gray_code.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace symrig::calibration {

/// Pixels that change clearly from photograph to photograph, whatever their order is. Nothing of the sequence
/// is assumed, so they also serve a sequence that contradicts itself.
struct ClearPixels {
  std::vector<std::size_t> at;  ///< at most 8,000, away from the last rows and columns
  double contrast = 0;          ///< rms of their range over the photographs

  static constexpr int kNext = 2;  ///< pixels to the right and below that exist
};

/// A pixel's range is that of its values without the largest and the smallest one. Clear: at least a quarter
/// of the range that one pixel in twenty exceeds.
/// held_out: a pair that is not used.
ClearPixels find_clear_pixels(const CodePhotographs& photographs, const std::optional<int>& held_out = {});

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
  /// A larger `difference` has a clear sign: three tenths of the pixel's amplitude, and three sigmas.
  float clear_difference(std::size_t pixel) const;
  const std::string& name(int photograph) const { return photographs.names[photograph]; }
};

/// A pixel is lit if its patterns and complements differ by more than noise. The limit: Σ (p − n)² over the
/// pairs is eight standard deviations above that of noise alone.
SequenceLight find_sequence_light(const CodePhotographs& photographs, const std::optional<int>& held_out);

}  // namespace symrig::calibration
