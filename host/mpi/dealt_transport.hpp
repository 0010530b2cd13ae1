// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "ranks.hpp"
#include "share.hpp"
#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_operator.hpp"

#include <filesystem>
#include <memory>

namespace symrig::mpi {

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
