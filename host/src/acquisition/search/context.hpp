// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/refine/level_light.hpp"
#include "acquisition/search/known.hpp"
#include "acquisition/search/photographer.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace symrig::acquisition {

/// What the parts of a hierarchical capture share.
struct Context {
  const CaptureSettings& options;
  const BlockTree& tree;
  int channels;
  Photographer& photographer;
  Known& known;
  std::vector<double> flood_squared;             ///< F² of each channel; F: RMS of the flood-lit photograph
  std::vector<std::int64_t> patterns_per_level;  ///< [0] is the flood-lit one and the checks
  std::vector<LevelLight> level_light{};         ///< of the first photographs of each level that was searched
  /// Light beside a lit block as a share of the light on it, one in four pixels lit, as the level before saw
  /// it: what the next may expect of blocks with themselves. None: no level has looked yet.
  std::optional<float> beside{};

  /// τ_A², the mean square misfit that a leaf may have, in units of F².
  double tolerance() const { return options.rule.flood_fraction * options.rule.flood_fraction; }
};

}  // namespace symrig::acquisition
