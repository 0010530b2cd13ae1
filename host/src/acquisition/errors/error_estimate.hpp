// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/gain_mismatch.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/base/progress.hpp"
#include "symrig/image/image.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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

/// Light that goes from a pixel to its neighbours on one side and not back. Its cause is a camera that is
/// shifted against the projector, or a one-sided flare. No symmetric tensor can hold it, and no tensor of an
/// aligned rig should.
struct OneSided {
  double energy = 0;  ///< Σ of the squares of such entries of T, at the least, beyond what chance does
  double sigmas = 0;  ///< significance
};

/// residual: (T − T̃) z on the grid, one channel, 0 where not valid; z: random signs of the lit pixels, 0
/// elsewhere. For entries
/// E, E[z' K' E z] = (lit share) Σ K E, which an antisymmetric K takes of one-sided light alone; K is ± 1
/// within boxes of 1, 2, 4 … pixels on either side of a pixel, along rows, columns and diagonals. With other
/// signs the sum would be 0 ± |K residual|. The strongest K is told.
OneSided one_sided(const Image<float>& residual, const Image<float>& z);

/// A check photograph, and what is left of it.
struct CheckResidual {
  const TreePhotograph& photograph;
  std::span<const float> left;  ///< [channel][pixel]
};

/// What the light of a tensor takes for one pattern, for Work: two operations a number of two bytes.
inline std::int64_t operations_of_light(const TransportTensor& tensor) {
  return tensor.bytes();
}

/// The halves of a set less each other: what all transport leaves, with random signs.
/// set: two halves at least.
void add_signed_halves(std::span<const CheckResidual> set, const GainError& gain, EnergySums& to);

/// The mean of all halves, which is even light: of all photographs it has the least noise. Each sample is a
/// sum over the photographs, so it is squared at the end.
class FloodSum {
 public:
  FloodSum(std::size_t samples, std::size_t sets);
  void add(std::span<const CheckResidual> set, const GainError& gain);
  void finish(EnergySums& to) const;

 private:
  double weight_;  // of a half
  PagedVector<double> error_, photograph_, variance_;
  PagedVector<double> here_, there_;  // as in GainError
  PagedVector<char> valid_;
};

/// What the estimates need of the check photographs and of what a finished tensor leaves of them. They are
/// added up set by set, so that one set is in memory. In tree order, channels added up.
class CheckSums {
 public:
  /// sets: how many are going to be added. work: counts what that takes.
  CheckSums(const TransportTensor& tensor, const GainMismatch& mismatch, std::size_t sets, Work work = {});

  /// photographs: of one set, in the order of Checks::Check; six of the first set, four of each other one.
  void add(std::span<const TreePhotograph* const> photographs);
  /// After the last set.
  void finish();

  const TransportTensor& tensor() const { return tensor_; }
  std::size_t sets() const { return sets_; }
  const Work& work() const { return work_; }

  /// Each half less its complement; the mean of all of them.
  EnergySums halves, flood;
  /// Of the first set alone: a half, the picture, the bar, and the bar where it is dark.
  EnergySums half, natural, bar, outside_bar;
  /// The sparse pairs, less each other, where they are dark; the halves, where they are dark.
  EnergySums sparse_pairs, dark_halves;
  /// Share of pixels that are lit in some photograph of a sparse pair, on average.
  double lit = 0;
  /// Light to one side, by the halves or the sparse pair of the first set: whichever is surer.
  OneSided one_sided;

 private:
  void add_first(std::span<const CheckResidual> set, const GainError& gain);

  const TransportTensor& tensor_;
  const GainMismatch& mismatch_;
  Work work_;
  std::size_t sets_, added_ = 0;
  FloodSum flood_;
  double doubt_ = 0;
};

/// The errors of a finished tensor by check photographs that it was not made from, each with its own error
/// (docs/research/error-estimates.md). The errors contain the mismatch of gains that `sums` knows.
/// noise_ratio: true over stated variance, as far as it is known to differ from 1.
ErrorEstimate estimate_errors(const CheckSums& sums, double noise_ratio = 1);

/// The frobenius error alone, by what is left of the two halves (Checks::halves) of residuals' photographs.
struct ErrorBar {
  double value = 0, half_width = 0;
};
ErrorBar frobenius_error(const BlockTree& tree, std::span<const Checks::Residual> residuals,
                         std::span<const TreePhotograph> left);

}  // namespace symrig::acquisition
