// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/gain_mismatch.hpp"
#include "symrig/acquisition/error_estimate.hpp"
#include "symrig/acquisition/internal/error_sums.hpp"
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
class CheckSums : public ErrorSums {
 public:
  /// sets: how many are going to be added. work: counts what that takes.
  CheckSums(const TransportTensor& tensor, const GainMismatch& mismatch, std::size_t sets, Work work = {});

  /// photographs: of one set, in the order of Checks::Check; six of the first set, four of each other one.
  void add(std::span<const TreePhotograph* const> photographs);
  /// After the last set.
  void finish();

 private:
  void add_first(std::span<const CheckResidual> set, const GainError& gain);

  const TransportTensor& tensor_;
  const GainMismatch& mismatch_;
  Work work_;
  std::size_t added_ = 0;
  FloodSum flood_;
  double doubt_ = 0;
};

/// The frobenius error alone, by what is left of the two halves (Checks::halves) of residuals' photographs.
struct ErrorBar {
  double value = 0, half_width = 0;
};
ErrorBar frobenius_error(const BlockTree& tree, std::span<const Checks::Residual> residuals,
                         std::span<const TreePhotograph> left);

}  // namespace symrig::acquisition
