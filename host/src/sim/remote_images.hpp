// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "sim/image_source.hpp"
#include "symrig/sim/simulated_pairs.hpp"

#include <memory>
#include <string>

namespace symrig::sim {

/// The frames of one pair, developed in the pair's own process.
class RemoteImages final : public ImageSource {
 public:
  /// frame: the grid of its frames. facts: what the pair must state of itself each time it is connected.
  RemoteImages(LinkedPair pair, PairLink::KeepWaiting keep_waiting, bool noisy, Grid frame, int channels);

  /// Connects again if the connection is lost.
  Result<void> open() override;
  Result<std::vector<CameraFrame>> develop(std::span<const LitPattern> patterns,
                                           std::span<const LitExposure> exposures) override;

 private:
  Result<void> develop_some(std::span<const LitPattern> patterns, std::span<const LitExposure> exposures,
                            std::vector<CameraFrame>& frames);
  Result<CameraFrame> receive(std::size_t number);
  std::string identity() const;

  LinkedPair pair_;
  PairLink::KeepWaiting keep_waiting_;
  bool noisy_;
  Grid frame_;
  int channels_;
  std::string identity_;
};

}  // namespace symrig::sim
