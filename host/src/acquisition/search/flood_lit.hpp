// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/node.hpp"
#include "acquisition/search/photographer.hpp"

#include <vector>

namespace symrig::acquisition {

/// The flood-lit photograph in tree order. It is the estimate of the root: c = r = T 1.
struct FloodLit {
  PagedVector<float> image;      ///< [channel][pixel]
  std::vector<PairNoise> noise;  ///< of each channel
  std::vector<double> squared;   ///< F² of each channel, the mean square of its valid pixels
  bool noisy = false;            ///< photographs have a variance

  /// Reads photograph 0 of the log.
  /// fails: bad_value (no pixel is valid); as Photographer::read.
  static Result<FloodLit> read(const Photographer& photographer, int channels);
};

}  // namespace symrig::acquisition
