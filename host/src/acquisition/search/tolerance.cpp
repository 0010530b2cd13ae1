// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/tolerance.hpp"

#include "acquisition/search/forecasts.hpp"
#include "acquisition/search/placement.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace symrig::acquisition {
namespace {

/// Error and uncertainty of a capture as a multiple of its tolerance.
constexpr double kErrorPerTolerance = 8;
/// Beyond 25 times the usual tolerance, tests take wrong leaves for right ones.
constexpr int kCoarsestSteps = 8;
/// Fewer save less than a search that ends above its target costs.
constexpr int kFewestSteps = 3;
/// Error grows with this power of the tolerance, or faster.
constexpr double kErrorPower = 0.7;
/// After leaves that were wrong: what the error was is not known.
constexpr int kStepsAfterWrongLeaves = 4;

int steps_of(double factor) {
  return static_cast<int>(std::floor(std::log(factor) / std::log(Coarseness{1}.factor())));
}

Coarseness worthwhile(int steps) {
  return {steps < kFewestSteps ? 0 : std::min(steps, kCoarsestSteps)};
}

}  // namespace

TargetTolerance::TargetTolerance(const CaptureSettings& options) : target_(options.target_error) {
  if (options.keeps_tolerance || !(target_ > 0)) return;
  const double finest = options.rule.flood_fraction;
  now_ = worthwhile(steps_of(target_ / (kErrorPerTolerance * finest)));
}

bool TargetTolerance::reached(const CaptureResult& ended) const {
  return target_ > 0 && ended.stated_error() && *ended.stated_error() <= target_;
}

bool TargetTolerance::search_again(const CaptureResult& ended) {
  if (now_.steps == 0 || ended.stopped_by != "done" || reached(ended)) return false;
  int finer = kStepsAfterWrongLeaves;
  if (const auto error = ended.stated_error(); error && !ended.undetermined) {
    if (!std::isfinite(*error)) return false;  // no light to be seen: no tolerance changes that
    finer = 1 - steps_of(std::pow(target_ / *error, 1 / kErrorPower));
  }
  now_ = worthwhile(now_.steps - finer);
  return true;
}

namespace {

/// A hundred times the tolerance.
constexpr int kMostSteps = 11;

/// From one level to the next. Without a budget scenes take 0.9 to 1.7 times as many photographs in the mean,
/// and level 2 more (forecasts.hpp). With a coarser tolerance they take about as many.
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
  bool settled = false;
  const auto settle_with = [&](int steps) {
    facts_.coarseness = next_ = {least_.steps + steps};
    pace_ = pace_from(before);
    // A level that was coarser itself is judged anew even by the tolerance without a budget.
    if (next_.steps > least_.steps || before.steps > least_.steps) tested = search.judge();
    if (std::exchange(settled, true)) {
      found_.known.rewind(known);
      next = open;
    }
    acquisition::settle(facts_, found_.known, level, tested, next);
  };
  int steps = 0;
  for (settle_with(0); !fits(next, left); settle_with(steps))
    if (++steps > kMostSteps) return settle_with(0);  // no tolerance helps: the search is cut
  if (next_.steps > most_.steps) most_ = next_;
}

/// The next level and those after it fit into the budget if all of them take as many photographs.
bool BudgetTolerance::fits(NodeLevel& next, const Left& left) const {
  const auto photographs = static_cast<double>(left(pace_));
  // No search takes more than brute force does; a larger budget, or none, needs no forecast.
  if (photographs >= static_cast<double>(facts_.tree.grid().size())) return true;
  if (facts_.tree.levels() < kFewestLevels) return true;
  const std::int64_t planned = LevelSearch(facts_, photographer_, found_, next).foreseen();
  const std::vector<double> children = children_per_block(facts_.tree);
  const bool coarser = next_.steps > least_.steps;
  const double all = photographs_if_growing({.level = next.level(), .planned = planned, .children = children},
                                            coarser ? kCoarserGrowth : kSteadySecond,
                                            coarser ? kCoarserGrowth : kSteadyGrowth);
  // The flood-lit photographs at the end; a scene without noise needs none.
  const double share = coarser ? facts_.options.economy.direct_share : 0;
  return share * static_cast<double>(photographer_.taken()) + (1 + share) * all <= photographs;
}

}  // namespace symrig::acquisition
