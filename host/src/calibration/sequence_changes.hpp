// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/clear_pixels.hpp"
#include "calibration/sequence_cause.hpp"

#include <optional>
#include <vector>

namespace symrig::calibration {

/// What changes the light of photographs whose order is right: exposures that overlap two patterns, bands,
/// light or exposures that change, another black level, a curved response. The sums of the pairs then are not
/// one picture. Each cause is a model of how they differ, with few numbers; it is named with these and with
/// the share of the differences that it explains. Best first, and only those that explain nearly as much as
/// the best.
class LightChanges {
 public:
  /// held_out: a pair that is not used.
  LightChanges(const CodePhotographs& photographs, const ClearPixels& clear,
               const std::optional<int>& held_out = {});

  /// Those that explain most of the differences: of a sequence that contradicts itself.
  std::vector<Cause> most() const;
  /// Those that explain all of them but noise: of a sequence with another finding that would do too.
  std::vector<Cause> all() const;
  /// Those that explain most of the differences, and cost positions: they change light by 15 % or more.
  std::vector<Cause> spoiling() const;
  /// Those that make light wrong by more than a few percent, however small they are beside the noise.
  std::vector<Cause> harmful() const;

 private:
  struct Found {
    Cause cause;
    double explained = 0;     ///< share of the squares of the differences
    double effect = 0;        ///< relative error of light
    double rank = 0;          ///< the order in which causes are named
    bool particular = false;  ///< no wrong pattern in one photograph looks like it
  };
  std::vector<Cause> named(double least_explained, double least_effect, bool particular) const;

  std::vector<Found> found_;
};

/// Values below black or above white beside the edges of stripes: no light does that, but sharpening does.
std::vector<Cause> find_sharpening(const CodePhotographs& photographs, const ClearPixels& clear,
                                   const std::optional<int>& held_out = {});

}  // namespace symrig::calibration
