// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/energy_sums.hpp"
#include "acquisition/errors/gain_mismatch.hpp"
#include "acquisition/errors/one_sided.hpp"
#include "symrig/base/paged_vector.hpp"
#include "symrig/base/work.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace symrig::acquisition {

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

}  // namespace symrig::acquisition
