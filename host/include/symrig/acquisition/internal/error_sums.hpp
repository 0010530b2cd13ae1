// SPDX-License-Identifier: Apache-2.0
// Errors of a finished T, on cells or on pixels of the camera, by photographs that were held out.
#pragma once

#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>

namespace symrig::acquisition {

/// What the photographs of a capture that are held out show, set by set: a random half of the pixels and its
/// complement, two random thirty-seconds, and in the first set also a bar and a picture.
struct HeldOutOrder {
  static constexpr std::int64_t kCount = 6;  ///< photographs of the first set
  enum Check : std::size_t { kHalf, kOtherHalf, kSparse, kOtherSparse, kBar, kNatural };
  static constexpr std::int64_t kFurther = 4;  ///< photographs of a further set, ordered as the first four
};

/// Squares of a signed sum of photographs, gathered pixel by pixel (tree order, channels added up), each less
/// what noise adds to it.
class EnergySums {
 public:
  explicit EnergySums(std::size_t pixels) : error_at_(pixels), signal_at_(pixels) {}

  std::size_t pixels() const { return error_at_.size(); }

  /// e: what the tensor leaves; y: the photograph; model: what the tensor says; variance: of y.
  void add(std::size_t pixel, double e, double y, double model, double variance);

  /// The square of the error of a pixel is more than that of what the tensor leaves, by this.
  void add_error(std::size_t pixel, double more) {
    error += more;
    error_at_[pixel] += more;
    added_ += more;
  }
  /// What add_error() added is known to this share of itself (one sigma).
  void doubt_added(double share) { doubt_ = share * share * added_ * added_; }

  double error = 0, signal = 0, model = 0, noise = 0;
  /// Variance of `error` and `signal` by noise alone: Var[r²] = 4 v r̄² + 2 v², r̄² = r² − v.
  double error_noise() const { return (error_noise_ > resolution_ ? error_noise_ : resolution_) + doubt_; }
  double signal_noise() const { return signal_noise_ > resolution_ ? signal_noise_ : resolution_; }
  /// The same where there is nothing but noise: 2 Σ v².
  double resolution() const { return resolution_; }
  std::size_t samples() const { return samples_; }

  /// Variance of error − ratio · signal over random patterns, noise included. Each level with at least 16
  /// blocks gives an estimate, from the scatter between its blocks (delete-one jackknife). The result is the
  /// largest. Light that is wrong over a whole block moves all of its pixels together, so no one size of
  /// block will do.
  double scatter(const BlockTree& tree, double ratio) const;

 private:
  PagedVector<double> error_at_, signal_at_;
  double error_noise_ = 0, signal_noise_ = 0, resolution_ = 0, added_ = 0, doubt_ = 0;
  std::size_t samples_ = 0;
};

/// Where a mean of squares lies, of which one sample is `energy` with variance `variance`. The interval is
/// energy · d / χ²_d at ± 2 standard deviations, d = 2 energy² / variance degrees of freedom [Wilson,
/// Hilferty 1931]. It goes at most ten standard deviations up. Below one standard deviation: from 0 to four
/// more.
struct EnergyInterval {
  double low = 0, high = 0;
};
EnergyInterval energy_interval(double energy, double variance);

/// The larger side of the interval of √(energy / signal) around `value`.
double half_width(const EnergyInterval& interval, double signal, double value);

/// Light that goes from a pixel to its neighbours on one side and not back. Its cause is a camera that is
/// shifted against the projector, or a one-sided flare. No symmetric tensor can hold it, and no tensor of an
/// aligned rig should.
struct OneSided {
  double energy = 0;  ///< Σ of the squares of such entries of T, at the least, beyond what chance does
  double sigmas = 0;  ///< significance
};

/// What the estimates need of held-out photographs and of what T leaves of them. Channels are added up.
struct ErrorSums {
  /// of: the cells. sets: of photographs.
  ErrorSums(const BlockTree& of, std::size_t sets_of_photographs)
      : tree(of),
        sets(sets_of_photographs),
        halves(of.order().size()),
        flood(halves.pixels()),
        half(halves.pixels()),
        natural(halves.pixels()),
        bar(halves.pixels()),
        outside_bar(halves.pixels()),
        sparse_pairs(halves.pixels()),
        dark_halves(halves.pixels()) {}

  const BlockTree& tree;
  std::size_t sets;
  /// Each half less its complement; the mean of all of them.
  EnergySums halves, flood;
  /// Of the first set alone: a half, the picture, the bar, and the bar where it is dark.
  EnergySums half, natural, bar, outside_bar;
  /// The sparse pairs, less each other, where they are dark; the halves, where they are dark.
  EnergySums sparse_pairs, dark_halves;
  /// Share of pixels that are lit in some photograph of a sparse pair, on average.
  double lit = 0;
  /// Samples that are dark in a sparse pair, by those that are dark in a half or in the other.
  double dark_share = 1;
  /// Light to one side, by the halves or the sparse pair of the first set: whichever is surer.
  OneSided one_sided = {};
  /// Mean of (T̃ z)² over dark samples and random signs z of so many lit pixels. The sparse pair would show
  /// this much of the tensor's own light if it were shown many times.
  std::function<double(double lit)> mean_sparse_energy = {};
};

/// The errors of a finished tensor by check photographs that it was not made from, each with its own error
/// (docs/research/error-estimates.md). The errors contain the mismatch of gains that `sums` knows.
/// noise_ratio: true over stated variance, as far as it is known to differ from 1.
ErrorEstimate estimate_errors(const ErrorSums& sums, double noise_ratio = 1);

/// The same of a capture: its photographs say how well their noise is stated, and whether the lamp has
/// changed since.
ErrorEstimate estimate_errors(const ErrorSums& sums, const NoiseCheck& noise);

}  // namespace symrig::acquisition
