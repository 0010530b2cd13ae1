// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/errors/checks.hpp"
#include "acquisition/errors/error_estimate.hpp"
#include "acquisition/errors/gain_mismatch.hpp"
#include "acquisition/refine/direct_light.hpp"
#include "acquisition/tree/known_transport.hpp"
#include "acquisition/tree/node.hpp"
#include "acquisition/tree/rank_test.hpp"
#include "acquisition/tree/search_facts.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace symrig::acquisition {

/// What a search has found so far.
struct Findings {
  explicit Findings(const SearchFacts& facts)
      : known(facts.tree, facts.channels, facts.options.work),
        decay(facts.options.economy.decay),
        gain(facts.tree) {
    for (int level = 0; level < facts.tree.levels(); ++level)
      open.emplace_back(facts.tree, level, facts.channels);
  }

  KnownTransport known;
  std::vector<NodeLevel> open;            ///< unknown nodes, by level
  Decay decay;                            ///< what one level learned for the next
  GainEvidence gain;                      ///< light that blocks exchange both ways
  std::vector<LevelLight> level_light{};  ///< of the first photographs of each level that was searched
  /// Light beside a lit block as a share of the light on it, while one pixel in four is lit. Measured by the
  /// last level; the next level expects it of blocks with themselves. None: no level was searched yet.
  std::optional<float> beside{};
  std::vector<std::int64_t> patterns_per_level{};  ///< [0] is the flood-lit one and the checks

  bool any_open() const {
    return std::any_of(open.begin(), open.end(),
                       [](const NodeLevel& level) { return !level.nodes().empty(); });
  }
  /// No node is unknown any more.
  void close_all(const SearchFacts& facts) {
    for (NodeLevel& level : open) level = NodeLevel(facts.tree, level.level(), facts.channels);
  }
};

// What is assumed of nodes that no photograph has tested, so that the tensor is complete at any moment.

/// Assumed transport of the unknown nodes. A pair of different blocks is the product of its images. A block
/// with itself is direct light alone, or also the product of its images.
struct Assumption {
  bool direct = true;  ///< of blocks with themselves
  ErrorBar error;      ///< estimated frobenius error if the search ended here
};

/// The assumption that the checks contradict less. Changes nothing that is known.
Assumption better_assumption(const SearchFacts& facts, Findings& found, Checks& checks);

/// The tensor with all unknown nodes as assumed. Changes nothing that is known.
TensorBuilder assumed_draft(const SearchFacts& facts, Findings& found, bool direct);

/// Stores all unknown nodes as assumed. checks: may be nullptr; then blocks with themselves are direct light.
void accept_open(const SearchFacts& facts, Findings& found, Checks* checks);

}  // namespace symrig::acquisition
