// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/search_forecast.hpp"

#include <algorithm>
#include <cmath>

namespace symrig::acquisition {
namespace {

constexpr double kLeastGrowth = 0.95, kMostGrowth = 1.7;  // from one level to the next, in the mean
constexpr double kLeastMost = 1.35;                       // even where the last step was small
/// Level 1 has 16 photographs at most and nearly always that many: they say little of level 2.
constexpr double kLeastSecond = 1.8, kMostSecond = 4;
constexpr int kFirstGrowth = 3;  // the first level whose growth predicts the next
constexpr double kFull = 4;      // children of a block far from single pixels
constexpr double kAlone = 0.7;   // share of four photographs a block beyond which nothing is shared

double most_growth(const LevelPlan& plan) {
  if (plan.level < kFirstGrowth || plan.before < 1) return kMostGrowth;
  const double last = static_cast<double>(plan.planned) / static_cast<double>(plan.before);
  return std::clamp(1.1 * last, kLeastMost, kMostGrowth);
}

/// Photographs of later levels by a growth that is always the same.
double all_later(const LevelPlan& plan, double second, double growth) {
  const std::size_t level = plan.level;
  double photographs = static_cast<double>(plan.planned) * kFull / plan.children[level];
  double sum = 0;
  for (std::size_t k = level + 1; k < plan.children.size(); ++k) {
    photographs *= k == 2 ? second : growth;
    sum += photographs * plan.children[k] / kFull;
  }
  return sum;
}

bool shares_nothing(const LevelPlan& plan) {
  return plan.level >= kFirstGrowth &&
         static_cast<double>(plan.planned) >= kAlone * std::pow(4.0, plan.level + 1);
}

}  // namespace

std::vector<double> children_per_block(const BlockTree& tree) {
  std::vector<double> children;
  for (int l = 0; l + 1 < tree.levels(); ++l)
    children.push_back(static_cast<double>(tree.level(l + 1).size()) /
                       static_cast<double>(tree.level(l).size()));
  return children;
}

double photographs_if_growing(const LevelPlan& plan, double second, double growth) {
  if (plan.planned < 1 || static_cast<std::size_t>(plan.level) >= plan.children.size()) return 0;
  return static_cast<double>(plan.planned) + all_later(plan, second, growth);
}

double most_photographs(const LevelPlan& plan) {
  return photographs_if_growing(plan, kMostSecond, most_growth(plan));
}

UnitsToCome forecast_later(const LevelPlan& plan) {
  const bool known = plan.level >= 1 && static_cast<std::size_t>(plan.level) < plan.children.size();
  if (!known || plan.planned < 1 || shares_nothing(plan)) return {};
  const auto with_direct = [&plan](double later) {
    return later + plan.direct_share * (static_cast<double>(plan.taken) + later);
  };
  // Without noise no flood-lit photograph is taken at the end.
  return {std::llround(all_later(plan, kLeastSecond, kLeastGrowth)),
          std::llround(with_direct(all_later(plan, kMostSecond, most_growth(plan))))};
}

}  // namespace symrig::acquisition
