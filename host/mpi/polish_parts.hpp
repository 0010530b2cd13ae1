// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/photographer.hpp"
#include "dealt_transport.hpp"
#include "symrig/acquisition/photograph_log.hpp"
#include "symrig/acquisition/probe.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_tensor.hpp"

#include <cstddef>
#include <memory>
#include <span>
#include <string>
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

/// The photographs of a capture that has ended, by their log numbers.
struct CapturePhotographs {
  std::unique_ptr<const PhotographLog> log;
  acquisition::LogRange held_out{0, 0};             ///< the first six
  std::vector<acquisition::LogRange> further = {};  ///< sets of four
  acquisition::LogRange flood_lit{0, 0};            ///< those at the end
  std::vector<acquisition::LogRange> used = {};     ///< all but the held-out ones
};

/// Opens the log of a scene. That it is the scene's log shows in the held-out photographs: all of them must
/// be in it, bit for bit. fails: as read_photograph_log; bad_value (another capture's log, or a scene without
/// held-out photographs).
Result<CapturePhotographs> open_photographs(const std::string& path, const StoredScene& scene,
                                            const std::string& scene_path);

/// The rig of a capture that has ended: its photographs are in the log.
class EndedRig final : public Probe {
 public:
  explicit EndedRig(const PhotographLog& log) : log_(log) {}
  Grid grid() const override { return log_.grid(); }
  int channels() const override { return log_.channels(); }
  Result<std::vector<Radiance>> measure(std::span<const Pattern>) override {
    return Error{ErrorCode::bad_argument, "this capture has ended", "capture again"};
  }
  ProbeCost cost() const override { return {}; }
  std::string describe() const override { return "the rig of a capture that has ended"; }

 private:
  const PhotographLog& log_;
};

}  // namespace symrig::mpi
