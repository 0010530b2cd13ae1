// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <vector>

namespace symrig::acquisition {

/// What does not change while a scene is searched.
struct SceneFacts {
  const CaptureSettings& options;
  const BlockTree& tree;
  int channels;
  std::vector<double> flood_squared;  ///< F² of each channel; F: RMS of the flood-lit photograph
  double residual_shift = 0;          ///< of all photographs [pixels] (Probe::residual_shift)

  /// τ_A², the mean square misfit that a leaf may have, in units of F².
  double tolerance() const { return options.rule.flood_fraction * options.rule.flood_fraction; }
};

}  // namespace symrig::acquisition
