// SPDX-License-Identifier: Apache-2.0
#include "rig/bracket_taker.hpp"

#include <algorithm>
#include <utility>

namespace symrig {
namespace {

std::vector<std::size_t> missing_in(const TakenBrackets& brackets) {
  std::vector<std::size_t> missing;
  for (std::size_t i = 0; i < brackets.size(); ++i)
    if (!brackets[i]) missing.push_back(i);
  return missing;
}

}  // namespace

Result<std::vector<TakenBracket>> BracketTaker::take(std::span<const Pattern> patterns,
                                                     std::span<const Exposures> exposures) {
  const WantedPhotographs all{patterns, exposures};
  TakenBrackets brackets(patterns.size());
  for (PatternPacing* one : pacings_) one->begin(all);
  std::size_t left = patterns.size();
  for (int tries = 0; left > 0;) {
    if (const auto tried = pacing().attempt(all, missing_in(brackets), brackets); !tried)
      SYMRIG_CHECK(recover(tried.error()));
    const std::size_t still = missing_in(brackets).size();
    tries = still < left ? 0 : tries + 1;
    left = still;
    if (left > 0 && tries > runs_.options().retakes) return runs_.give_up(tries);
  }
  std::vector<TakenBracket> taken;
  for (auto& bracket : brackets) taken.push_back(*std::move(bracket));
  return taken;
}

Result<std::vector<TakenBracket>> BracketTaker::take(std::span<const Pattern> patterns,
                                                     std::span<const Exposures> exposures,
                                                     PlaneScheduler planner) {
  planes_.set_scheduler(std::move(planner));
  auto taken = take(patterns, exposures);
  planes_.set_scheduler(plan_planes);
  return taken;
}

PatternPacing& BracketTaker::pacing() {
  const Projector& projector = runs_.devices().projector();
  if (projector.planes().planes > 0) return planes_;
  if (projector.pacing() == Pacing::host) return shown_;
  return triggered_;
}

Result<void> BracketTaker::recover(const Error& error) {
  SYMRIG_TRY(const DeviceSet::Part part, runs_.recover(error));
  if (part == DeviceSet::Part::projector)
    for (PatternPacing* one : pacings_) one->projector_reopened();
  return {};
}

Result<CameraTiming> BracketTaker::timing() const {
  CameraTiming timing = camera().timing();
  if (projector().planes().planes == 0) return timing;
  const PlaneRules rules = plane_rules();
  SYMRIG_TRY(const Nanoseconds longest, longest_in_planes(rules));
  if (!rules.may_cross()) timing.max_exposure = std::min(timing.max_exposure, longest);
  return timing;
}

}  // namespace symrig
