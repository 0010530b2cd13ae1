// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hdr/sensor_statistics.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace symrig::hdr {

/// Dark frames of one exposure. Sums are whole numbers, so the order of the frames has no effect.
class DarkLevel {
 public:
  explicit DarkLevel(Grid grid);

  void add(Codes codes);
  /// Finds defects, after all frames. light: codes of a lit frame, of which a dark projector shows a share;
  /// that share is subtracted. saturated: codes from here on are not used for it.
  /// needs: two frames or more.
  void finish(std::span<const double> light, double saturated);

  double frames() const { return static_cast<double>(means_.size()); }
  double mean() const;              ///< code, of all pixels
  double variance_of_mean() const;  ///< of the mean code of one frame
  // After finish().
  double pedestal() const { return pedestal_; }  ///< mean code of the pixels without defects
  double variance() const { return variance_; }  ///< of a pixel from frame to frame [DN²]
  double samples() const { return samples_; }    ///< degrees of freedom of variance()
  double dsnu() const { return dsnu_; }
  std::span<const std::uint8_t> defects() const { return defects_; }

 private:
  PixelMoments moments() const;
  void subtract_light(std::vector<double>& means, std::span<const double> light, double saturated) const;

  std::vector<std::uint32_t> sums_;
  std::vector<std::uint64_t> squares_;
  std::vector<double> means_;  // of each frame
  std::vector<std::uint8_t> defects_;
  double pedestal_ = 0, variance_ = 0, samples_ = 0, dsnu_ = 0;
};

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
