// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <vector>

namespace symrig {

/// Merges any number of frames one by one. A frame can be freed after it was added. Memory: four floats a
/// pixel for any number of frames.
///   mean = (a Σ d_k + b Σ t_k d_k) / (a Σ t_k + b Σ t_k²)
/// over the usable samples d_k = code − pedestal; the variance is that of this mean. The best weight of a
/// sample is h(t_k) = t_k / Var[d_k]. The line a + b t replaces it with the least increase of variance. h is
/// taken at the common rate Σ d / Σ t of all usable samples (the reason is in merge.cpp). error: with one or
/// two different exposures the weights are those of merge(). With more, the variance is at most 5 % above the
/// Cramér-Rao bound if neighbouring exposures have a ratio of 2 or more.
class MergeStream {
 public:
  /// exposures: those of all frames to come, in any order. Planned values suffice: they only affect the
  /// weights. fails: bad_argument (no exposures, noise model unusable, empty grid).
  static Result<MergeStream> begin(Grid grid, int channels, const NoiseModel& noise,
                                   std::span<const Nanoseconds> exposures);

  /// fails: size_mismatch, bad_argument (exposure ≤ 0).
  Result<void> add(const Frame& frame);
  /// Call it after the last add().  fails: as merge().
  Result<Radiance> finish(const MergeOptions& options = {}) const;

  int frames() const { return frames_; }

  /// Frames of one exposure, as planned.
  struct Group {
    double time;   ///< in units of the longest exposure
    double count;  ///< number of frames
    double total;  ///< Σ t of all frames that are not longer
  };

 private:
  MergeStream(Grid grid, int channels, const NoiseModel& noise);
  Grid grid_;
  int channels_;
  NoiseModel noise_;
  double unit_ = 1;            // the longest exposure planned [s]
  std::vector<Group> groups_;  // ascending
  int frames_ = 0;
  Image<float> sum_, time_, weighted_sum_, weighted_time_;  // Σd, Σt, Σtd, Σt²
};

}  // namespace symrig
