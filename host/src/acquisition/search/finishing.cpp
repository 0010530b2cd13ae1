// SPDX-License-Identifier: Apache-2.0
#include "acquisition/search/finishing.hpp"

#include "acquisition/errors/error_estimate.hpp"
#include "acquisition/errors/noise_check.hpp"
#include "acquisition/refine/direct_light.hpp"
#include "acquisition/refine/polish.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <span>
#include <utility>

namespace symrig::acquisition {
namespace {

/// The photographs of level 0, which light the children of the whole grid one after another. None if combs
/// for short-range light came first.
Result<std::vector<TreePhotograph>> quarters(const BlockTree& tree, const Photographer& photographer,
                                             std::int64_t first) {
  std::vector<TreePhotograph> parts;
  std::vector<float> lit(tree.order().size());
  SYMRIG_CHECK(photographer.read(
      first, tree.level(0)[0].children, [&](std::int64_t, std::span<TreePhotograph> photographs) {
        for (const TreePhotograph& p : photographs)
          std::transform(lit.begin(), lit.end(), p.pattern.begin(), lit.begin(), std::plus<>());
        parts.insert(parts.end(), photographs.begin(), photographs.end());
      }));
  if (std::any_of(lit.begin(), lit.end(), [](float light) { return light != 1; })) parts.clear();
  return parts;
}

/// Compares photographs of the same light that a capture has taken: the first flood-lit one, some of those at
/// the end, and the held-out halves. again: log numbers of the flood-lit ones at the end.
/// rest: of a capture that brute force ended, or nullptr.
Result<NoiseCheck> noise_of_capture(const BlockTree& tree, const Photographer& photographer,
                                    const Checks& checks, LogRange again, const BruteForceRest* rest) {
  constexpr std::int64_t kMost = 8;
  FloodNoise noise(tree);
  const auto add = [&](std::int64_t, std::span<TreePhotograph> floods) {
    for (const TreePhotograph& flood : floods) noise.add(flood);
  };
  SYMRIG_CHECK(photographer.read(0, 1, add));
  SYMRIG_CHECK(photographer.read(again.first, std::min(again.last - again.first, kMost), add));
  NoiseEvidence besides;
  std::vector<TreePhotograph> parts;
  if (rest != nullptr) {
    besides.mirrored = rest->mirrored();
    SYMRIG_TRY(parts, quarters(tree, photographer, checks.last()));
    besides.parts = parts;
  }
  const auto& held_out = checks.photographs();
  return std::move(noise).judge(&held_out[Checks::kHalf].photograph, &held_out[Checks::kOtherHalf].photograph,
                                besides);
}

/// How many further sets make half of the intervals narrow enough: its square falls as 1 / sets.
std::int64_t sets_wanted(const CaptureResult& result) {
  // A quarter is a factor of 0.8 to 1.25 at 1.65 standard deviations, which is 90 %.
  constexpr double kSure = 0.3;
  double wanted = 1;
  for (const auto field : {&TransportErrors::frobenius, &TransportErrors::indirect}) {
    const double value = (*result.estimated).*field;
    if (value > 0)
      wanted = std::max(wanted, std::pow(result.estimated_half_width.*field / (kSure * value), 2));
  }
  constexpr double kMost = 1000;
  return static_cast<std::int64_t>(std::ceil(std::min(wanted, kMost))) - 1;
}

}  // namespace

Result<void> Finishing::photograph_again(const DirectLightRefit& how) {
  constexpr std::int64_t kFewest = 4;
  const auto share = static_cast<std::int64_t>(facts_.options.economy.direct_share *
                                               static_cast<double>(photographer_.taken()));
  const std::int64_t count = std::min(how.noisy ? std::max(kFewest, share) : 0, how.budget);
  const auto pixels = static_cast<std::int32_t>(facts_.tree.grid().size());
  photographer_.expect_later(kNoneToCome);
  const std::int64_t first = photographer_.taken();
  SYMRIG_CHECK(
      photographer_.take_in_time("direct light", std::vector<LitBlocks>(count, LitBlocks{{0, pixels}})));
  again_ = {first, photographer_.taken()};
  found_.patterns_per_level.push_back(again_.last - again_.first);
  return {};
}

/// What known transport may miss in a sample, mean square, by channel.
std::vector<double> Finishing::least_misfit() const {
  std::vector<double> misfit;
  for (const double f : facts_.flood_squared) misfit.push_back(facts_.tolerance() * f);
  return misfit;
}

Result<void> Finishing::refit_direct_light(const DirectLightRefit& how) {
  if (facts_.options.economy.direct_share <= 0 || found_.known.scalars().empty()) return {};
  SYMRIG_CHECK(photograph_again(how));
  photographer_.work().begin("refit of the direct light");
  DirectLight::Model model{least_misfit(), std::vector<double>(facts_.flood_squared.size())};
  if (checks_ != nullptr) model.half = Checks::misfit_of_half(checks_->residuals(found_.known));
  DirectLight direct(found_.known, facts_.tree.order().size(), std::move(model));
  if (!how.reopened) {
    const LaterLight later(found_.known, facts_.tree, facts_.channels);
    for (const LevelLight& level : found_.level_light) direct.add(level, later, found_.known);
  }
  for (const LogRange& range : whole_photographs(how.reopened))
    SYMRIG_CHECK(photographer_.read(
        range.first, range.last - range.first, [&](std::int64_t, std::span<TreePhotograph> photographs) {
          found_.known.subtract_from(photographs);
          direct.add(photographs);
          photographer_.work().add(2 * std::ssize(photographs) * std::ssize(photographs[0].mean));
        }));
  direct.apply(found_.known);
  return {};
}

/// Photographs that the direct light is refitted to as a whole: all but the checks, and but those whose light
/// on lit pixels LevelLight holds. A reopened leaf changes what was subtracted there, so that they count as a
/// whole again.
std::vector<LogRange> Finishing::whole_photographs(bool reopened) const {
  std::vector<LogRange> left_out;
  if (checks_ != nullptr) left_out = checks_->ranges();
  if (!reopened)
    for (const LevelLight& level : found_.level_light) left_out.push_back(level.photographs);
  return remaining(std::move(left_out), photographer_.taken());
}

/// Steps of Economy::polish that fit into Economy::polish_share. The host's time is a forecast, so that a
/// capture ends alike on every machine.
int Finishing::polish_steps() const {
  // A sample of a photograph each time that a step goes through it: 12 to 23 ns from 64x64 to 310x350 (two
  // cores of 2.0 GHz, 25 November 2026).
  constexpr double kSampleSeconds = 20e-9;
  const Economy& economy = facts_.options.economy;
  const double samples = static_cast<double>(photographer_.taken()) *
                         static_cast<double>(facts_.tree.order().size()) * facts_.channels;
  const double step = kSampleSeconds * samples * (kConjugateSteps + 2);
  const double most = economy.polish_share * photographer_.rig_seconds() / step;
  return most > 0 && most < economy.polish ? static_cast<int>(most) : economy.polish;
}

Result<void> Finishing::polish() {
  const int steps = polish_steps();
  if (steps <= 0) return {};
  // Told before it is known how much it is: to lay it out takes time too.
  photographer_.work().begin("refit");
  const std::vector<LogRange> held_out = checks_ != nullptr ? checks_->ranges() : std::vector<LogRange>();
  Polish polish(facts_, photographer_, found_.known, remaining(held_out, photographer_.taken()),
                least_misfit());
  photographer_.work().begin("refit", steps * polish.operations(kConjugateSteps));
  for (int k = 0; k < steps; ++k) {
    SYMRIG_TRY(const Polish::Outcome outcome, polish.step(kConjugateSteps));
    if (outcome.after >= outcome.before) break;
  }
  return {};
}

Result<void> Finishing::make_sure(std::int64_t budget, CaptureResult& result) {
  const auto share = static_cast<std::int64_t>(facts_.options.economy.check_share *
                                               static_cast<double>(photographer_.taken()));
  const std::int64_t in_time =
      photographer_.seconds_left().photographs(photographer_.rig_seconds(), checks_->seconds_each());
  const std::int64_t sets =
      std::min(sets_wanted(result), std::min({budget, share, in_time}) / Checks::kFurther);
  if (sets <= 0) return {};
  photographer_.expect_later(kNoneToCome);
  SYMRIG_CHECK(checks_->take_further(sets, facts_.tree, photographer_));
  found_.patterns_per_level.back() += sets * Checks::kFurther;
  return estimate(result.tensor, nullptr, result);
}

Result<void> Finishing::estimate(const TransportTensor& tensor, const BruteForceRest* rest,
                                 CaptureResult& result) const {
  result.gain_mismatch = found_.gain.fit();
  return estimate_finished(tensor, photographer_, *checks_, again_, rest, result);
}

Result<void> estimate_finished(const TransportTensor& tensor, const Photographer& photographer,
                               const Checks& checks, LogRange again, const BruteForceRest* rest,
                               CaptureResult& result) {
  photographer.work().begin("estimated errors");
  SYMRIG_TRY(result.noise_check, noise_of_capture(tensor.camera_tree(), photographer, checks, again, rest));
  CheckSums sums(tensor, result.gain_mismatch, checks.sets(), photographer.work());
  SYMRIG_CHECK(checks.visit_sets(photographer, [&](auto set) { sums.add(set); }));
  sums.finish();
  ErrorEstimate estimate = estimate_errors(sums, result.noise_check);
  result.estimated = estimate.value;
  result.estimated_half_width = estimate.half_width;
  result.estimate_not_given = std::move(estimate.not_given);
  return {};
}

}  // namespace symrig::acquisition
