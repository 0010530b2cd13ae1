// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/seconds_left.hpp"
#include "acquisition/tree/tree_photograph.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "symrig/tensor/internal/kernels.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace symrig::acquisition {

/// Photographs [first, last) of the log.
struct LogRange {
  std::int64_t first, last;
};

/// What ranges of [0, taken) leave, ascending, without empty ones. left_out: in any order, apart from each
/// other.
std::vector<LogRange> remaining(std::vector<LogRange> left_out, std::int64_t taken);

/// Lit ranges of tree pixels: what a pattern of blocks is before it is a picture.
struct LitRange {
  std::int32_t begin, end;
};
using LitBlocks = std::vector<LitRange>;

/// Which pixels a pattern of blocks lights, in tree order: a bit and a half for each pixel.
class LitPixels {
 public:
  /// blocks: apart from each other, in any order.
  LitPixels(LitBlocks blocks, std::size_t pixels);

  bool operator[](std::int32_t t) const { return (words_[word(t)] >> (t & 63) & 1) != 0; }
  /// True if a pixel of [begin, end) is lit.
  bool any(std::int32_t begin, std::int32_t end) const { return before(begin) != before(end); }
  /// Σ values[t − begin] over the lit t of [begin, begin + size).  error: n ε Σ|values| for n lit pixels.
  float sum(std::int32_t begin, std::span<const float> values) const;

 private:
  static std::size_t word(std::int32_t t) { return static_cast<std::size_t>(t) / 64; }
  /// The number of lit pixels before this one.
  std::int32_t before(std::int32_t t) const;

  LitBlocks blocks_;  // by begin
  std::vector<std::uint64_t> words_;
  std::vector<std::int32_t> before_word_;
};

/// A photograph before it is taken, as far as it can be foreseen: [channel][pixel] in tree order.
struct Preview {
  PagedVector<float> known;    ///< light of known transport
  PagedVector<float> unknown;  ///< what the estimates of unknown nodes make of the rest
};

/// Forecasts what photographs will show (Probe::measure_expected).
class Forecaster {
 public:
  Forecaster() = default;
  Forecaster(const Forecaster&) = delete;
  Forecaster& operator=(const Forecaster&) = delete;
  virtual ~Forecaster() = default;

  /// previews: one a pattern, or none at all. most: of each.
  virtual std::vector<Expectation> expect(std::span<const LitBlocks> patterns,
                                          std::span<const Preview> previews, SecondsEach most) const = 0;
};

/// Bytes of the photographs and patterns that a capture holds between rig and search.
std::int64_t bytes_in_flight(Grid grid, int channels);

/// Shows patterns made of blocks, and gives the photographs in tree order. It asks for them in batches, so
/// that memory stays bounded. While the rig photographs one batch, another thread uses the one before and
/// prepares the next. It counts photographs and reports progress.
class Photographer {
 public:
  /// log: where the probe logs its photographs, number by number (LoggedProbe); needed for take() and read().
  Photographer(Probe& probe, const PhotographLog* log, const BlockTree& tree, Work work)
      : probe_(probe), log_(log), tree_(tree), channels_(probe.channels()), work_(std::move(work)) {}

  /// Goes on where another one stopped, in another tree of the same grid.
  Photographer(const Photographer& before, const BlockTree& tree)
      : probe_(before.probe_),
        log_(before.log_),
        tree_(tree),
        channels_(before.channels_),
        work_(before.work_),
        seconds_left_(before.seconds_left_),
        taken_(before.taken_),
        measure_seconds_(before.measure_seconds_) {}

  /// How many photographs come after those that are asked for next, for progress.
  void expect_later(UnitsToCome later) { later_ = later; }

  /// From now on. Must outlive this.
  void forecast_by(const Forecaster& forecaster) { forecaster_ = &forecaster; }

  /// The budget of seconds.
  SecondsLeft& seconds_left() { return seconds_left_; }
  const SecondsLeft& seconds_left() const { return seconds_left_; }

  /// Takes photographs that are in the log from then on, the first under number taken().
  /// fails: what the probe fails with, interrupted, frame_missing, size_mismatch.
  Result<void> take(std::string_view stage, std::span<const LitBlocks> patterns);
  /// The same of as many patterns as the budget of seconds has room for, the first ones. Result: how many.
  Result<std::size_t> take_in_time(std::string_view stage, std::span<const LitBlocks> patterns);

  /// True if photographs are so large that take() hands on fewer than a batch of the kernels at a time. Then
  /// work on a batch would be work for photographs that are not there (KnownTransport::subtract_lit).
  bool hands_on_few() const { return handed_on() < tensor::kBatch; }

  /// Photographs from number `first` on, which may be changed but not kept. Calls do not nest.
  using Use = std::function<void(std::int64_t first, std::span<TreePhotograph> photographs)>;
  /// Foresees patterns from number `first` on, one for each of `previews`. What they hold already is memory
  /// to be used again.
  using MakePreviews = std::function<void(std::size_t first, std::span<Preview> previews)>;
  /// Takes photographs and hands them on as they come, some at a time. preview is asked where it matters.
  /// fails: also bad_value (a photograph is not finite where it is said to be valid).
  Result<void> take(std::string_view stage, std::span<const LitBlocks> patterns, const Use& use,
                    const MakePreviews& preview = {});
  /// The same of as many patterns as the budget of seconds has room for. Result: how many.
  Result<std::size_t> take_in_time(std::string_view stage, std::span<const LitBlocks> patterns,
                                   const Use& use, const MakePreviews& preview);

  /// Reads photographs [first, first + count) again, some at a time: at least `fewest`, as long as there are
  /// so many.  fails: as PhotographLog, bad_value.
  Result<void> read(std::int64_t first, std::int64_t count, const Use& use, std::size_t fewest = 1) const;
  /// Frees the photographs whose memory is kept for the next time.
  void free_pool() {
    pool_ = {};
    previews_ = {};
  }

  /// Takes photographs that are needed only once: use() is called once a pattern, from several threads at
  /// once.
  using UseOne = std::function<void(std::size_t index, TreePhotograph& photograph)>;
  Result<void> take_each(std::string_view stage, std::span<const LitBlocks> patterns, const UseOne& use);

  /// What the capture's work is counted with.
  const Work& work() const { return work_; }
  std::int64_t taken() const { return taken_; }
  double measure_seconds() const { return measure_seconds_; }
  double rig_seconds() const { return probe_.cost().rig_seconds; }
  std::int64_t frames() const { return probe_.cost().frames; }
  bool plans_exposures() const { return probe_.plans_exposures(1); }

 private:
  using Answer = std::function<Result<void>(std::size_t first, std::vector<Radiance>& answers)>;
  std::size_t batch_size() const;
  struct How {
    MakePreviews preview = {};
    bool all = true;  ///< false: only what the budget of seconds has room for
  };
  Result<std::size_t> take_batches(std::string_view stage, std::span<const LitBlocks> patterns,
                                   const Answer& use, const How& how);
  Result<std::size_t> take_some(std::string_view stage, std::span<const LitBlocks> patterns, const Use& use,
                                const How& how);
  /// What a rig needs for some patterns.
  struct Batch {
    std::vector<Pattern> pictures;
    std::vector<Expectation> expected;  ///< empty: exposures are not planned
    SecondsEach most;                   ///< for each photograph
  };
  /// Patterns that are photographed together, and how.
  struct Plan {
    std::size_t first = 0, count = 0;
    bool exposures = false;  ///< are planned
    SecondsEach most;
  };
  Plan plan(std::size_t first, std::size_t patterns, std::size_t before, double reserved) const;
  bool shorten(Batch& batch) const;
  Batch prepare(std::span<const LitBlocks> patterns, const Plan& plan, const MakePreviews& preview) const;
  Result<std::vector<Radiance>> measure(const ProgressEvent& begun, const Batch& batch);
  std::int64_t samples() const;
  bool plans_next(std::size_t photographs) const;
  std::size_t handed_on() const;
  std::span<TreePhotograph> pool(std::size_t size) const;

  Probe& probe_;
  const PhotographLog* log_;
  const BlockTree& tree_;
  int channels_;
  Work work_;
  const Forecaster* forecaster_ = nullptr;
  SecondsLeft seconds_left_;
  UnitsToCome later_ = {};
  std::int64_t taken_ = 0;
  double measure_seconds_ = 0;
  mutable std::vector<TreePhotograph> pool_;  // kept for its memory
  mutable std::vector<Preview> previews_;     // so are they
};

}  // namespace symrig::acquisition
