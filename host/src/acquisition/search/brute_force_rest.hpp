// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/noise_check.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/search_facts.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <vector>

namespace symrig::acquisition {

/// Brute force for what a search has left, in no more photographs than brute force by itself takes.
/// m photographs have been taken of N pixels: N − m pixels (L) are lit alone, m (U) are not. T_LL, T_LU and
/// T_UL follow, because T is symmetric. T_UU follows from the m photographs Y of patterns P:
///   P_U T_UU = Y_U − P_L T_LU,  by least squares over symmetric T_UU, with the noise of both sides and a
///   prior
/// The prior is how far T_LU lies from what the search found, or from 0 where that is nearer. For the
/// diagonal it is how far T_LL's diagonal lies from its mean. With hardly a pixel lit alone, it is what the
/// search found, and how much of the photographs that leaves. error: patterns of rank r leave (m − r)(m − r +
/// 1) / 2 numbers of T_UU to the prior (docs/research/not-data-sparse.md).
class BruteForceRest {
 public:
  /// Memory for a grid of so many pixels.
  static std::int64_t bytes(std::int64_t pixels, int channels);

  /// Takes the photographs of single pixels. known: what the search knew.  fails: as Photographer::take.
  static Result<BruteForceRest> take(const SearchFacts& facts, Photographer& photographer,
                                     const TransportTensor& known);

  /// The photographs of single pixels against each other: T_ij − T_ji.
  Scatter mirrored() const;

  /// T from the photographs of single pixels and from these (log numbers).  fails: as Photographer::read.
  Result<TransportTensor> tensor(const BlockTree& tree, const Photographer& photographer,
                                 const std::vector<LogRange>& others) const;

 private:
  /// One channel of T, in tree order.
  struct Channel {
    std::vector<float> value;     ///< [row · pixels + col]
    std::vector<float> variance;  ///< NaN: not photographed; then value is what the search found
  };
  struct Prior;
  struct Others;

  BruteForceRest() = default;
  std::size_t at(std::size_t row, std::size_t col) const { return row * pixels_ + col; }
  void keep(std::size_t col, const TreePhotograph& photograph);
  void keep_known(const TransportTensor& known);
  void mirror(Channel& channel) const;
  Prior prior_of(const Channel& channel) const;
  void fill(Channel& channel, std::size_t number, const Others& others, const Work& work) const;
  TransportTensor packed(const BlockTree& tree, const std::vector<Channel>& channels, const Work& work) const;

  std::size_t pixels_ = 0;
  std::vector<std::int32_t> alone_, rest_;  ///< L and U, tree pixels
  std::vector<Channel> channels_;
};

}  // namespace symrig::acquisition
