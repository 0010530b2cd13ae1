// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/budget_tolerance.hpp"

#include "acquisition/search/placement.hpp"
#include "acquisition/search/search_forecast.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::acquisition {
namespace {

/// A hundred times the tolerance. Where even that does not help, the last levels are cut short.
constexpr int kMostSteps = 11;
constexpr std::int64_t kOneColour = 4;  // photographs of a level

/// From one level to the next. Without a budget scenes take 0.9 to 1.7 times as many photographs in the mean,
/// and level 2 more (search_forecast.hpp). With a coarser tolerance they take about as many.
constexpr double kSteadySecond = 1.8, kSteadyGrowth = 0.95;
constexpr double kCoarserGrowth = 1;

/// In fewer levels (16x16 cells have 5), one level alone takes most photographs, and nothing forecasts it.
constexpr int kFewestLevels = 6;

/// A photograph takes this power of the tolerance. Light alone would take its square, but bright pixels,
/// readout and refresh do not depend on it. On the simulated rigs: 0.2 to 0.5.
constexpr double kPower = 0.4;

}  // namespace

double BudgetTolerance::pace_from(Coarseness before) const {
  return shortens_ ? std::pow(before.factor() / next_.factor(), kPower) : 1;
}

void BudgetTolerance::settle(const LevelSearch& search, const NodeLevel& level, std::vector<Tested> tested,
                             NodeLevel& next, const Left& left) {
  const KnownTransport::Mark known = found_.known.mark();
  const NodeLevel open = next;
  const Coarseness before = next_;
  for (int steps = 0; steps <= kMostSteps; ++steps) {
    facts_.coarseness = next_ = {steps};
    pace_ = pace_from(before);
    // The photographs of a level that was coarser itself show no more than its own tolerance.
    if (steps > 0 || before.steps > 0) tested = search.judge();
    if (steps > 0) {
      found_.known.rewind(known);
      next = open;
    }
    acquisition::settle(facts_, found_.known, level, tested, next);
    if (fits(next, left)) break;
  }
  if (next_.steps > most_.steps) most_ = next_;
}

/// The next level and those after it fit into the budget if all of them take as many photographs.
bool BudgetTolerance::fits(NodeLevel& next, const Left& left) const {
  const auto photographs = static_cast<double>(left(pace_));
  if (photographs > 4 * static_cast<double>(facts_.tree.grid().size())) return true;
  const std::int64_t planned = LevelSearch(facts_, photographer_, found_, next).foreseen();
  if (planned <= kOneColour || facts_.tree.levels() < kFewestLevels) return true;
  const std::vector<double> children = children_per_block(facts_.tree);
  const bool coarser = next_.steps > 0;
  const double all = photographs_if_growing({.level = next.level(), .planned = planned, .children = children},
                                            coarser ? kCoarserGrowth : kSteadySecond,
                                            coarser ? kCoarserGrowth : kSteadyGrowth);
  // The flood-lit photographs at the end; a scene without noise needs none.
  const double share = coarser ? facts_.options.economy.direct_share : 0;
  return share * static_cast<double>(photographer_.taken()) + (1 + share) * all <= photographs;
}

}  // namespace symrig::acquisition
