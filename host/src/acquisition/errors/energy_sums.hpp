// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/paged_vector.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstddef>

namespace symrig::acquisition {

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

}  // namespace symrig::acquisition
