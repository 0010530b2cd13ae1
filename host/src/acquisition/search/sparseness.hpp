// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/budget.hpp"
#include "acquisition/search/photographer.hpp"
#include "acquisition/search/scene_facts.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace symrig::acquisition {

/// Decides whether the transport is data-sparse enough to be searched, or better left to brute force
/// (docs/research/not-data-sparse.md).
class Sparseness {
 public:
  Sparseness(const SceneFacts& facts, const Photographer& photographer, const Budget& budget)
      : facts_(facts), photographer_(photographer), budget_(budget) {}

  /// Adds what the tests of a level found.
  void add(const LevelEvidence& level) { evidence_.push_back(level); }

  /// False, and brute_force_takes_over(), if brute force should measure the rest. photographs: of the next
  /// round of `level`. later: of the levels after it, at least.
  bool worth_searching(int level, std::int64_t photographs, std::int64_t later);
  /// What is missed, by the checks: the estimated error if the search ended now.
  struct Missed {
    double between_pixels = 0;  ///< of the light between pixels (Checks::errors, indirect); 0: not known
    double of_all = 0;          ///< of all light (frobenius); 0: not known
  };
  /// Before leaves are reopened.
  void misses(const Missed& missed) { missed_ = missed; }
  /// After a level. What is missed between pixels stays as it was before leaves were reopened.
  void misses_of_all(double share) { missed_.of_all = share; }
  /// The checks find leaves wrong that cannot be reopened within the budget.
  void doubt_leaves();

  /// Brute force measures the rest.
  bool brute_force_takes_over() const { return undetermined_ && undetermined_->completed; }
  /// Brute force can take over at any moment, so that no round is cut short to what is left of it.
  bool can_take_over() const;

  /// Why the search gave up, and on what evidence; none: it did not.
  std::optional<Undetermined> finding() && { return std::move(undetermined_); }

 private:
  std::int64_t dense_levels(int level) const;
  bool unstructured() const;
  bool brute_force_fits() const;
  bool misses_little() const;
  bool misses_little_of_all() const;
  bool doubt(std::string reason, std::int64_t forecast);

  const SceneFacts& facts_;
  const Photographer& photographer_;
  const Budget& budget_;
  std::vector<LevelEvidence> evidence_;
  Missed missed_;
  std::optional<Undetermined> undetermined_;
};

}  // namespace symrig::acquisition
