// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ranks.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/file.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace symrig::mpi {

/// A run of leaves: [begin, end).
struct LeafRange {
  std::size_t begin = 0, end = 0;
};

/// Deals leaves to `count` ranks in runs of about equal cost. first: what the first rank has to do beside its
/// leaves. Every leaf is in one run; a run may be empty. No run exceeds its fair share of the whole by more
/// than the cost of one leaf, unless `first` alone does.
std::vector<LeafRange> deal(std::span<const std::int64_t> costs, std::int64_t first, int count);

/// The bytes that a batch of 16 lights moves for each leaf. A half of a factor is read once. A factor column
/// has 16 floats that are written as dots, read by its partner, written as weights and read again: four times
/// 64 bytes. Measured: docs/research/machines.md.
std::vector<std::int64_t> costs_of(const TransportTensor& tensor);

/// What one rank holds of a scene.
struct Share {
  StoredScene scene;           ///< its tensor is this rank's part of T; T is the sum over the ranks
  std::uint64_t identity = 0;  ///< of the whole scene: equal on all ranks if they read the same file
};

/// Of a whole scene: equal for copies of one file, and different for other captures and fits.
std::uint64_t identity_of(const StoredScene& scene);

/// Reads the share of one rank of `count`. Everything but leaves belongs to the first rank.
/// fails: as load_scene.
Result<Share> read_share(const std::filesystem::path& path, int rank, int count);

/// The part of a tensor with these leaves; `rest`: also with all that is no leaf.
/// fails: as TransportTensor::visit_leaves.
Result<TransportTensor> part_of(const TransportTensor& whole, LeafRange leaves, bool rest);

/// T, its leaves dealt over the ranks. The first rank runs the job and owns this; the others wait in help()
/// until it asks them for their part of a product.
/// error: that of TransportTensor::apply, whose sums over leaves are now sums of count() sums: ≤ (|J| +
/// leaves on the pixel's path + count() + 4) ε · Σ_leaf |A||B|ᵀ|pattern| per pixel, ε = 2⁻²⁴.
class DealtTransport final : public TransportOperator {
 public:
  /// Every rank reads its share. fails: as read_share on any rank (the text names it); bad_value (the ranks
  /// read different files).
  static Result<std::shared_ptr<const DealtTransport>> open(const Ranks& ranks,
                                                            const std::filesystem::path& path);
  DealtTransport(const Ranks& ranks, Share share) : ranks_(ranks), share_(std::move(share)) {}

  /// What the file says beside T; its tensor is the first rank's share.
  const StoredScene& scene() const { return share_.scene; }

  Grid camera_grid() const override { return share_.scene.tensor.camera_grid(); }
  Grid projector_grid() const override { return share_.scene.tensor.projector_grid(); }
  int channels() const override { return share_.scene.tensor.channels(); }
  Result<Image<float>> apply(const Image<float>& pattern) const override;
  /// One reduction for 16 patterns.
  Result<std::vector<Image<float>>> apply_batch(std::span<const Image<float>> patterns) const override;
  Result<Image<float>> adjoint(const Image<float>& picture) const override;

 private:
  Ranks ranks_;
  Share share_;
};

/// On every rank but the first: does what the first one asks for, until it calls release(). Returns the exit
/// code that release() got. share: this rank's part of T, if it has one before a scene is opened.
int help(const Ranks& ranks, TransportTensor share = {});

/// On the first rank, when its job is done: the others return from help().
void release(const Ranks& ranks, int exit_code);

}  // namespace symrig::mpi
