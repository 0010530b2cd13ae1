// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hdr/sensor_statistics.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace symrig::hdr {

struct CodeRange {
  double pedestal = 0;
  double noise = 0;  ///< of a dark pixel, rms [DN]
  int largest = 0;   ///< code
};

/// A point of the transfer curve, and the largest code of its samples.
struct GroupPoint {
  TransferPoint at;
  int largest = 0;
};

/// The pixels of a scene, sorted into groups of about equal light by two frames.
class LightGroups {
 public:
  /// defects: pixels that are left out.
  LightGroups(Codes a, Codes b, std::span<const std::uint8_t> defects, const CodeRange& range);

  /// Adds a point for each group, or several for a large one.
  void add_points(Codes a, Codes b, std::vector<GroupPoint>& points) const;
  /// The codes of at most 65,536 of the pixels with this light or more, in codes of the two frames.
  std::vector<double> codes_of(Codes codes, double least) const;
  /// Sums of two frames over the pixels whose light is above the noise, and at most this much.
  std::pair<double, double> light_of(Codes a, Codes b, double most) const;

 private:
  /// Neighbours in the order, of one group.
  struct Part {
    std::size_t begin = 0, end = 0;
    double light = 0;  ///< the least of its group
  };
  void divide(std::size_t begin, std::size_t end, double light);

  CodeRange range_;
  std::vector<std::uint32_t> order_;  // pixels, darkest group first; saturated ones last
  std::vector<Part> parts_;           // without saturated pixels
  std::size_t saturated_ = 0;         // where they begin in the order
};

}  // namespace symrig::hdr
