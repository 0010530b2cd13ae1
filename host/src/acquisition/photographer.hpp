// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace symrig::acquisition {

/// A photograph in tree order. mean, variance, valid: [channel][pixel].
struct TreePhotograph {
  std::vector<float> pattern;  ///< what was lit, [pixel]
  std::vector<float> mean, variance;
  std::vector<std::uint8_t> valid;
};

/// mean −= T_known · pattern: what is left is the light of unknown transport. [Garg06 §5, eq. 6]  Leaves
/// pattern negated.
void subtract_known(TreePhotograph& photograph, const TransportTensor& known, int channels);

/// Lit ranges of tree pixels: what a pattern of blocks is before it is a picture.
struct LitRange {
  std::int32_t begin, end;
};
using LitBlocks = std::vector<LitRange>;

/// Shows patterns made of blocks and hands each photograph on in tree order. Batches them, so that neither a
/// rig nor a host waits for the other pattern by pattern and memory stays bounded; counts them; tells
/// progress.
class Photographer {
 public:
  /// Called once a pattern, from several threads at once; index counts from 0 in each take().
  using Take = std::function<void(std::size_t index, TreePhotograph& photograph)>;

  Photographer(Probe& probe, const BlockTree& tree, Progress progress)
      : probe_(probe), tree_(tree), channels_(probe.channels()), progress_(std::move(progress)) {}

  /// fails: what the probe fails with, interrupted, bad_value (a photograph that is not finite where it is
  /// said to be valid).
  Result<void> take(std::string_view stage, std::span<const LitBlocks> patterns, const Take& use);

  std::int64_t taken() const { return taken_; }
  double measure_seconds() const { return measure_seconds_; }

 private:
  std::size_t batch_size() const;
  Result<void> take_batch(std::span<const LitBlocks> patterns, std::size_t first, const Take& use);

  Probe& probe_;
  const BlockTree& tree_;
  int channels_;
  Progress progress_;
  std::int64_t taken_ = 0;
  double measure_seconds_ = 0;
};

}  // namespace symrig::acquisition
