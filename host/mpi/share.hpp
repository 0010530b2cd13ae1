// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/tensor/file.hpp"

#include <cstdint>
#include <filesystem>
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

}  // namespace symrig::mpi
