// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/known_transport.hpp"
#include "share.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace symrig::mpi {

/// T as a polish deals it: leaves in parts of about equal cost, and single entries in parts of equal number.
/// The result depends on how many parts there are, and not on how many ranks have them. A part costs a pass
/// over all samples, so as many as ranks are fastest.
class PolishParts {
 public:
  /// parts: at least as many as ranks.
  /// fails: bad_value (T is not symmetric, or was measured column by column).
  static Result<PolishParts> of(const TransportTensor& whole, int ranks, int parts);

  std::size_t count() const { return leaves_.size(); }
  /// Parts [begin, end) of a rank. Each rank has one at least.
  LeafRange of_rank(int rank) const;
  int rank_of(std::size_t part) const;

  /// The parts of one rank, read from the scene. Each has at most its share of the leaves in memory.
  /// fails: as TransportTensor::visit_leaves.
  Result<std::vector<acquisition::KnownTransport>> read(const TransportTensor& whole, int rank) const;

  /// The numbers of a part: factors of its leaves as TensorBuilder takes them, then its entries.
  std::vector<float> numbers(const acquisition::KnownTransport& known) const;
  std::size_t number_count(const TransportTensor& whole, std::size_t part) const;
  /// All parts as a tensor again. Its leaves, blocks and empty leaves are those of `whole`.
  class Assembly {
   public:
    Assembly(const PolishParts& parts, const TransportTensor& whole);
    /// In the order of the parts.
    void add(std::size_t part, std::span<const float> numbers);
    TransportTensor finish() &&;

   private:
    const PolishParts& parts_;
    const TransportTensor& whole_;
    TensorBuilder builder_;
    std::vector<float> entries_;
  };

 private:
  PolishParts(int ranks, int channels) : ranks_(ranks), channels_(channels) {}
  void add_band(const TransportTensor& whole);

  int ranks_, channels_;
  std::vector<LeafRange> leaves_, entries_;  ///< of each part
  std::vector<ScalarLeaf> at_;               ///< single entries, then those of the band that are not 0
  std::vector<float> values_;                ///< [entry][channel]
  std::size_t band_begin_ = 0;               ///< of at_
  int band_radius_ = 0;                      ///< 0: no band
  std::vector<std::size_t> band_places_;     ///< of its entries, in BandLeaf::values of channel 0
};

}  // namespace symrig::mpi
