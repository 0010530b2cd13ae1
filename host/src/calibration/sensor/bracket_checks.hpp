// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/calibration/sensor_folder.hpp"
#include "symrig/hdr/merge.hpp"

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace symrig {

/// The bracket as frames, which refer to the photographs.
std::vector<Frame> bracket_of(const SensorPhotographs& photographs);

/// The code at which the longer frames of a bracket stay although the shorter ones expect more light.
std::optional<int> clipping_of(std::span<const Frame> bracket, const std::optional<Sensor>& sensor);

/// Lets a sensor clip where the bracket shows it, if its noise model says that it clips later. Returns
/// whether it did.
bool clip_as_seen(std::span<const Frame> bracket, Sensor& sensor);

/// The range of usable codes: codes below it are dark, codes above it are clipped. sensor: if it is measured.
ResponseOptions usable_codes(const SensorPhotographs& photographs, const std::optional<Sensor>& sensor);

}  // namespace symrig

namespace symrig::calibration {

/// A longer exposure of a still scene is brighter, whatever the camera's curve is. Compares each exposure
/// with the next one that is at least 1.5 times as long, pixel by pixel, before anything is fitted. No
/// verdict where fewer than 100 pixels tell. fails: bad_value (the longer one is darker; or both are equally
/// bright in their middle tones).
Result<void> check_bracket_order(const SensorPhotographs& photographs);

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
