// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hdr/sensor_statistics.hpp"

#include <cstdint>
#include <span>
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

}  // namespace symrig::hdr
