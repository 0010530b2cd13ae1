// SPDX-License-Identifier: Apache-2.0
// What a capture runs with, and what it refuses to run with. Commands and bindings hand their options on.
#include "symrig/acquisition/capture.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr int kMostPolish = 20;

Error refused(std::string what, std::string next) {
  return {ErrorCode::bad_argument, std::move(what), std::move(next)};
}

Result<void> check_share(const char* option, const std::optional<double>& value) {
  if (!value || (*value > 0 && *value < 1)) return {};
  return refused(fmt::format("{} {} is not a share of the flood-lit signal", option, *value),
                 "give a number above 0 and below 1, such as 3e-4");
}

Result<void> check_budgets(const CaptureOptions& options) {
  if (options.max_patterns < 0)
    return refused(fmt::format("max_patterns {} leaves no photograph to take", options.max_patterns),
                   "give 1 or more");
  if (!(std::isfinite(options.max_seconds) && options.max_seconds >= 0))
    return refused(fmt::format("max_seconds {} is not a time to measure in", options.max_seconds),
                   "give the seconds on the rig's clock, such as 3600");
  if (!(options.target_error >= 0 && options.target_error < 1))
    return refused(
        fmt::format("target_error {} is not an error relative to the transport", options.target_error),
        "give a number above 0 and below 1, such as 0.02");
  if (options.memory_limit < 1)
    return refused(fmt::format("memory_limit {} leaves no byte to work in", options.memory_limit),
                   "give the bytes that a capture may take");
  return {};
}

/// A number of a rule, an economy or an exposure goal.
struct Number {
  const char* name;
  double value;
  double least, most;
};

Result<void> check_numbers(std::span<const Number> numbers) {
  for (const Number& n : numbers)
    if (!(n.value >= n.least && n.value <= n.most))
      return refused(fmt::format("{} cannot be {}", n.name, n.value),
                     std::isfinite(n.most) ? fmt::format("give a number from {} to {}", n.least, n.most)
                                           : fmt::format("give a number from {} on", n.least));
  return {};
}

Result<void> check_policy(const CaptureSettings& settings) {
  constexpr double kLarge = 1e30;  // finite, so that no sum of a few overflows
  const RankRule& rule = settings.rule;
  const Economy& economy = settings.economy;
  const ExposureGoal& goal = settings.exposure;
  return check_numbers(std::array{
      Number{"rule.signal_fraction", rule.signal_fraction, 0, kLarge},
      Number{"rule.flood_fraction", rule.flood_fraction, 0, kLarge},
      Number{"rule.empty_fraction", rule.empty_fraction, 0, kLarge},
      Number{"rule.noise_sigmas", rule.noise_sigmas, 0, kLarge},
      Number{"rule.concentration", rule.concentration, 0, 1},
      Number{"economy.decay", economy.decay, 0, kLarge},
      Number{"economy.risk", economy.risk, 0, kLarge},
      Number{"economy.largest_risk", economy.largest_risk, 0, kLarge},
      Number{"economy.dominance", economy.dominance, 0, 1},
      Number{"economy.diagonal_spread", economy.diagonal_spread, 0, kLarge},
      Number{"economy.check_share", economy.check_share, 0, 1},
      Number{"economy.direct_share", economy.direct_share, 0, 1},
      Number{"economy.polish_share", economy.polish_share, 0, kLarge},
      Number{"economy.rank", static_cast<double>(economy.rank), 1, BlockTree::kMaxChildren},
      Number{"exposure.share_of_tolerance", goal.share_of_tolerance, 0, kLarge},
      Number{"exposure.relative", goal.relative, 0, kLarge},
      Number{"exposure.relative_dark", goal.relative_dark, 0, kLarge},
  });
}

Result<void> check_times_and_steps(const CaptureSettings& settings) {
  const double longest = settings.exposure.longest_seconds;
  if (!(longest >= 0.01 && longest <= 1e5))
    return refused(fmt::format("photograph_seconds {} is no time to expose a photograph", longest),
                   "give seconds from 0.01 to 100000, such as 60");
  const int polish = settings.economy.polish;
  if (polish < 0 || polish > kMostPolish)
    return refused(fmt::format("polish {} is not a number of steps", polish),
                   fmt::format("give 0 to {}", kMostPolish));
  return {};
}

/// Refuses an option that would change nothing.
Result<void> check_effects(const CaptureOptions& options, const CaptureSettings& settings) {
  const bool dual = options.algorithm == Algorithm::dual;
  const AlgorithmInfo& algorithm = algorithm_info(options.algorithm);
  const bool to_its_end = !algorithm.hierarchical;
  const std::string with = fmt::format("with algorithm {}", algorithm.name);
  struct Idle {
    const char* option;
    bool idle;
    std::string why;
  };
  const std::array<Idle, 10> options_given{{
      {"tolerance", options.tolerance && !algorithm.tolerance, with + ", which measures each pixel"},
      {"tolerance", options.tolerance && dual && options.dual_threshold, "beside dual_threshold"},
      {"dual_threshold", options.dual_threshold && !dual, with},
      {"dual_subtracts", options.dual_subtracts && !dual, with},
      {"max_patterns", options.max_patterns > 0 && to_its_end, with + ", which runs to its end"},
      {"max_seconds", options.max_seconds > 0 && to_its_end, with + ", which runs to its end"},
      {"target_error", options.target_error > 0 && !settings.economy.checks,
       with + ", which holds no photographs out"},
      {"polish", options.polish && to_its_end, with},
      {"photograph_seconds", options.photograph_seconds && to_its_end, with},
      {"split", options.split && !algorithm.splits_views, with},
  }};
  for (const Idle& one : options_given)
    if (one.idle) return refused(fmt::format("{} has no effect {}", one.option, one.why), "leave it out");
  return {};
}

}  // namespace

Result<CaptureSettings> settings_of(const CaptureOptions& options) {
  const bool dual = options.algorithm == Algorithm::dual;
  const double threshold = *default_tolerance(Algorithm::dual);
  CaptureSettings settings{.algorithm = options.algorithm,
                           .rule = options.rule.value_or(default_rule(options.algorithm)),
                           .economy = options.economy.value_or(default_economy(options.algorithm)),
                           .exposure = options.exposure,
                           .split = options.split,
                           .dual_threshold = options.dual_threshold.value_or(
                               dual ? options.tolerance.value_or(threshold) : threshold),
                           .dual_subtracts = options.dual_subtracts,
                           .memory_limit = options.memory_limit,
                           .max_patterns = options.max_patterns,
                           .max_seconds = options.max_seconds,
                           .target_error = options.target_error,
                           .keeps_tolerance = options.tolerance || options.rule,
                           .unchecked = options.unchecked,
                           .log = options.log,
                           .work = Work(options.progress),
                           .look_aside = options.look_aside,
                           .before_search = options.before_search,
                           .foretell = options.foretell,
                           .watch = options.watch};
  if (options.tolerance) settings.rule.flood_fraction = settings.rule.empty_fraction = *options.tolerance;
  settings.exposure.longest_seconds = options.photograph_seconds.value_or(settings.exposure.longest_seconds);
  if (options.polish) {
    settings.economy.polish = *options.polish;
    settings.economy.polish_share = 0;
  }
  SYMRIG_CHECK(check_share("tolerance", options.tolerance));
  SYMRIG_CHECK(check_share("dual_threshold", options.dual_threshold));
  SYMRIG_CHECK(check_budgets(options));
  SYMRIG_CHECK(check_policy(settings));
  SYMRIG_CHECK(check_times_and_steps(settings));
  SYMRIG_CHECK(check_effects(options, settings));
  return settings;
}

Result<void> check_rig(const CaptureOptions& options, const Probe& rig) {
  if (options.split && rig.views().count() == 1)
    return refused("split has no effect on a rig of one view", "leave it out");
  if (options.photograph_seconds && !rig.plans_exposures(1))
    return refused(
        "photograph_seconds has no effect on a rig of fixed exposures (exposures = \"auto\" plans them)",
        "leave it out");
  return {};
}

}  // namespace symrig
