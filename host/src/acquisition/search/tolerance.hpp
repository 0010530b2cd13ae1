// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/search/findings.hpp"
#include "acquisition/search/level_search.hpp"
#include "acquisition/tree/photographer.hpp"
#include "acquisition/tree/search_facts.hpp"
#include "symrig/acquisition/capture.hpp"

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

namespace symrig::acquisition {

/// The tolerance with which a capture is expected to reach its target error (docs/research/budgets.md).
/// Coarser leaves cost fewer patterns and shorter exposures. What they miss of a scene is not known before,
/// so a search that ends above its target is followed by a finer one.
class TargetTolerance {
 public:
  explicit TargetTolerance(const CaptureSettings& options);

  /// By how much the next search is coarser than the user's tolerance.
  Coarseness coarseness() const { return now_; }

  /// Whether a search that ended like this has reached the target: its estimated error and the uncertainty.
  bool reached(const CaptureResult& ended) const;
  /// Whether a finer search follows; then coarseness() is its own. None follows if the target is reached, if
  /// a budget has ended the search, or if it was as fine as the user's tolerance.
  bool search_again(const CaptureResult& ended);

 private:
  double target_;
  Coarseness now_ = {};
};

/// Makes a budget reach to single pixels (docs/research/budgets.md). Most light between pixels goes to near
/// ones, and only the last levels see it. Where the budget would end before them, leaves of all levels may
/// miss more than those of a search without a budget (SearchFacts::coarseness when it begins). Each level
/// gets the finest tolerance with which it takes no more than its share of what is left.
class BudgetTolerance {
 public:
  BudgetTolerance(SearchFacts& facts, Photographer& photographer, Findings& found)
      : facts_(facts), photographer_(photographer), found_(found), least_(facts.coarseness) {}

  /// Coarser levels get shorter exposures.
  void shorten_exposures() { shortens_ = true; }

  /// Photographs that the user's budget has left, if one takes `pace` times as long as the last ones.
  using Left = std::function<std::int64_t(double pace)>;
  /// Makes leaves of the nodes of `level` that pass their test, and unknown nodes of `next` of the others.
  /// search: of that level, done. tested: by its rule.
  void settle(const LevelSearch& search, const NodeLevel& level, std::vector<Tested> tested, NodeLevel& next,
              const Left& left);

  /// By how much the level that is next raises the wanted noise of its photographs.
  Coarseness of_exposures() const { return shortens_ ? next_ : least_; }
  /// How long a photograph of it takes, as a multiple of those of the level before.
  double pace() const { return pace_; }
  /// The budget has made a level coarser.
  bool raised() const { return most_.steps > least_.steps; }
  /// What is done after the search must expect what the coarsest leaves may miss.
  void keep_coarsest() { facts_.coarseness = most_; }

 private:
  double pace_from(Coarseness before) const;
  bool fits(NodeLevel& next, const Left& left) const;

  SearchFacts& facts_;
  Photographer& photographer_;
  Findings& found_;
  Coarseness least_;  ///< of the whole search
  Coarseness next_ = least_, most_ = least_;
  double pace_ = 1;
  bool shortens_ = false;
};

}  // namespace symrig::acquisition
