// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/bracket_merge.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace symrig::calibration {

/// What has changed between two neighbouring exposures of a bracket in a part of the picture.
struct BracketChange {
  std::string what;                 ///< a sentence
  bool everywhere = false;          ///< bands, or so large a part that no pixel is sure
  std::vector<std::size_t> values;  ///< else: samples that have another light, as numbered in the codes
};

/// Where both exposures see a pixel well, its light differs by their ratio. A part of the pixels that differs
/// by another one has moved, or its light has changed; whole rows that do so are bands of a lamp that
/// flickers under a rolling shutter. merged: with its camera and ratios. Sees changes of a tenth of a pixel's
/// light in a hundredth of the pixels, and bands of 3 %.
std::vector<BracketChange> find_bracket_changes(const SensorPhotographs& photographs,
                                                std::span<const Frame> frames, const MergedBracket& merged);

}  // namespace symrig::calibration
