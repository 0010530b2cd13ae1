// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
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

/// Shows patterns made of blocks and hands photographs on in tree order. Asks for them in batches, so that
/// neither a rig nor a host waits for the other pattern by pattern and memory stays bounded; counts them;
/// tells progress.
class Photographer {
 public:
  /// log: where the probe logs its photographs, number by number (LoggedProbe); needed for take() and read().
  Photographer(Probe& probe, const PhotographLog* log, const BlockTree& tree, Progress progress)
      : probe_(probe), log_(log), tree_(tree), channels_(probe.channels()), progress_(std::move(progress)) {}

  /// Takes photographs that are in the log from then on, the first under number taken().
  /// fails: what the probe fails with, interrupted, frame_missing, size_mismatch.
  Result<void> take(std::string_view stage, std::span<const LitBlocks> patterns);

  /// Reads photographs [first, first + count) again, some at a time: use(number of the first, photographs).
  /// fails: as PhotographLog, bad_value (a photograph is not finite where it is said to be valid).
  using Use = std::function<void(std::int64_t first, std::span<TreePhotograph> photographs)>;
  Result<void> read(std::int64_t first, std::int64_t count, const Use& use) const;

  /// Takes photographs that nobody needs twice: use() is called once a pattern, from several threads at once.
  using UseOne = std::function<void(std::size_t index, TreePhotograph& photograph)>;
  Result<void> take_each(std::string_view stage, std::span<const LitBlocks> patterns, const UseOne& use);

  std::int64_t taken() const { return taken_; }
  double measure_seconds() const { return measure_seconds_; }
  double rig_seconds() const { return probe_.cost().rig_seconds; }

 private:
  using Answer = std::function<Result<void>(std::size_t first, std::span<const Pattern> pictures,
                                            std::vector<Radiance>& answers)>;
  std::size_t batch_size() const;
  Result<void> take_batches(std::string_view stage, std::span<const LitBlocks> patterns, const Answer& use);
  Result<std::vector<Radiance>> measure(std::span<const Pattern> pictures);

  Probe& probe_;
  const PhotographLog* log_;
  const BlockTree& tree_;
  int channels_;
  Progress progress_;
  std::int64_t taken_ = 0;
  double measure_seconds_ = 0;
};

}  // namespace symrig::acquisition
