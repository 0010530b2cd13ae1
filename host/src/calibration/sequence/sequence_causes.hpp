// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "calibration/sequence/sequence_light.hpp"
#include "symrig/base/result.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace symrig::calibration {

/// What may be wrong with a sequence.
struct SequenceCause {
  std::string what;  ///< with what was measured of it
  std::string next;  ///< what to do about it
};

/// The error that names up to three causes, the first ones.  Precondition: there is one.
inline Error error_of(const std::vector<SequenceCause>& causes) {
  constexpr std::size_t kMost = 3;
  if (causes.size() == 1) return {ErrorCode::bad_value, causes.front().what, causes.front().next};
  std::vector<std::string> named;
  for (std::size_t k = 0; k < std::min(causes.size(), kMost); ++k) named.push_back(causes[k].what);
  return {
      ErrorCode::bad_value,
      fmt::format("the photographs contradict each other; possible causes: {}", fmt::join(named, "; or ")),
      causes.front().next};
}

/// Other orders in which the photographs are a right sequence: one late, a lost or a doubled photograph,
/// backwards, beginning elsewhere, patterns before complements, finest stripes first. Of such an order, the
/// pairs add up to one picture, and where the code of neighbouring pixels differs, it differs by one. Empty
/// if the given order is as good, or if no order fits.
std::vector<SequenceCause> find_arrangements(const CodePhotographs& photographs, const ClearPixels& clear);

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
  std::vector<SequenceCause> most() const;
  /// Those that explain all of them but noise: of a sequence with another finding that would do too.
  std::vector<SequenceCause> all() const;
  /// Those that explain most of the differences, and cost positions: they change light by 15 % or more.
  std::vector<SequenceCause> spoiling() const;
  /// Those that make light wrong by more than a few percent, however small they are beside the noise.
  std::vector<SequenceCause> harmful() const;

 private:
  struct Found {
    SequenceCause cause;
    double explained = 0;     ///< share of the squares of the differences
    double effect = 0;        ///< relative error of light
    double rank = 0;          ///< the order in which causes are named
    bool particular = false;  ///< no wrong pattern in one photograph looks like it
  };
  std::vector<SequenceCause> named(double least_explained, double least_effect, bool particular) const;

  std::vector<Found> found_;
};

/// Values below black or above white beside the edges of stripes: no light does that, but sharpening does.
std::vector<SequenceCause> find_sharpening(const CodePhotographs& photographs, const ClearPixels& clear,
                                           const std::optional<int>& held_out = {});

}  // namespace symrig::calibration
