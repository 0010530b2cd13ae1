// SPDX-License-Identifier: Apache-2.0
#include "acquisition/algorithms.hpp"

#include "acquisition/light/light_witness.hpp"
#include "symrig/acquisition/capture.hpp"
#include "symrig/base/text.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

namespace symrig {
namespace {

constexpr double kTolerance = 3e-4;

constexpr std::array kAlgorithms{
    AlgorithmInfo{.algorithm = Algorithm::symrig,
                  .name = "symrig",
                  .description =
                      "hierarchical; accepts nodes without a test where it predicts leaves, and checks them "
                      "with held-out photographs",
                  .rule = {.noise_sigmas = 3, .concentration = 0.8},
                  .economy = {.decay = 0.05,
                              .look_in_the_dark = true,
                              .shrink_noise = true,
                              .checks = true,
                              .check_share = 0.05,
                              .direct_share = 0.05,
                              .polish = 2,
                              .polish_share = 0.5,
                              .rank = 3},
                  .tolerance = kTolerance,
                  .hierarchical = true,
                  .yields_to_brute_force = true,
                  .splits_views = true,
                  .run = acquisition::capture_hierarchy},
    AlgorithmInfo{.algorithm = Algorithm::paper,
                  .name = "paper",
                  .description = "as published by Garg et al. 2006",
                  .tolerance = kTolerance,
                  .hierarchical = true,
                  .reference = true,
                  .run = acquisition::capture_hierarchy},
    // A tight tolerance costs dual photography many patterns.
    AlgorithmInfo{.algorithm = Algorithm::dual,
                  .name = "dual",
                  .description = "dual photography, Sen et al. 2005: a baseline",
                  .tolerance = kTolerance,
                  .finest_factor = 1,
                  .run = acquisition::capture_dual},
    AlgorithmInfo{.algorithm = Algorithm::brute,
                  .name = "brute",
                  .description = "one pattern for each pixel: a baseline",
                  .run = acquisition::capture_brute},
};

/// A tolerance is that of the rule where there is a rule.
static_assert(std::all_of(kAlgorithms.begin(), kAlgorithms.end(), [](const AlgorithmInfo& one) {
  return !one.hierarchical || one.tolerance == one.rule.flood_fraction;
}));

}  // namespace

std::span<const AlgorithmInfo> algorithms() {
  return kAlgorithms;
}

const AlgorithmInfo& algorithm_info(Algorithm algorithm) {
  return *std::find_if(kAlgorithms.begin(), kAlgorithms.end(),
                       [algorithm](const AlgorithmInfo& one) { return one.algorithm == algorithm; });
}

std::string_view name(Algorithm algorithm) {
  return algorithm_info(algorithm).name;
}

std::span<const std::string_view> algorithm_names() {
  static const auto names = [] {
    std::array<std::string_view, kAlgorithms.size()> list;
    std::transform(kAlgorithms.begin(), kAlgorithms.end(), list.begin(),
                   [](const AlgorithmInfo& one) { return one.name; });
    return list;
  }();
  return names;
}

Result<Algorithm> parse_algorithm(std::string_view text) {
  for (const AlgorithmInfo& one : kAlgorithms)
    if (one.name == text) return one.algorithm;
  return Error{ErrorCode::unknown_name, "no algorithm '" + std::string(text) + "'",
               nearest_hint(text, algorithm_names())};
}

RankRule default_rule(Algorithm algorithm) {
  return algorithm_info(algorithm).rule;
}

Economy default_economy(Algorithm algorithm) {
  return algorithm_info(algorithm).economy;
}

std::optional<double> default_tolerance(Algorithm algorithm) {
  return algorithm_info(algorithm).tolerance;
}

namespace {

/// The flood-lit photograph, six held-out ones and three levels are as many as brute force takes: no search
/// saves any. With a budget there is still something to choose.
bool too_small_to_search(Grid grid, const CaptureSettings& settings) {
  constexpr std::int64_t kPixels = 64;
  return algorithm_info(settings.algorithm).yields_to_brute_force && grid.size() < kPixels &&
         settings.max_patterns == 0 && settings.max_seconds == 0 && settings.target_error == 0;
}

/// Larger than a search leaves that has found all it can, if its photographs are right.
bool has_large_error(const CaptureSettings& settings, const CaptureResult& result) {
  constexpr double kLarge = 0.04, kTolerances = 4;
  return result.stopped_by == "done" &&
         result.stated_error().value_or(0) > std::max(kLarge, kTolerances * settings.rule.flood_fraction);
}

/// A search that finds nothing to rely on is a reason to ask whether the rig is still the same.
Result<CaptureResult> run_watched(Probe& probe, CaptureSettings settings, const AlgorithmInfo& algorithm) {
  if (!settings.look_aside && settings.log == nullptr)
    settings.look_aside = [&probe](std::span<const Pattern> patterns, std::span<const Expectation> expected) {
      return expected.empty() ? probe.measure(patterns) : probe.measure_expected(patterns, expected);
    };
  acquisition::LightWitness witness(probe, settings.look_aside);
  SYMRIG_TRY(CaptureResult result, algorithm.run(witness, settings));
  const auto spares = [&](std::int64_t photographs) {
    return settings.max_seconds == 0 &&
           (settings.max_patterns == 0 || result.patterns + photographs <= settings.max_patterns);
  };
  if (has_large_error(settings, result) && spares(witness.cost_of_unjudged()))
    SYMRIG_CHECK(witness.look_at_unjudged());
  if (result.undetermined && spares(acquisition::LightWitness::kLooksAgain))
    SYMRIG_CHECK(witness.look_again());
  return result;
}

}  // namespace

Result<CaptureResult> capture(Probe& probe, const CaptureOptions& options) {
  SYMRIG_TRY(CaptureSettings settings, settings_of(options));
  if (!probe.grid().valid() || probe.channels() < 1)
    return Error{ErrorCode::bad_argument, "the rig has no pixels or no channels", "check its calibration"};
  SYMRIG_CHECK(check_aligned(probe));
  // With a log this has been asked of the rig itself: a log that is continued plans no exposures, whatever
  // the rig does.
  if (settings.log == nullptr) SYMRIG_CHECK(check_rig(options, probe));
  const AlgorithmInfo& algorithm = algorithm_info(settings.algorithm);
  const bool small = too_small_to_search(probe.grid(), settings);
  const bool searches = !small && algorithm.hierarchical;
  if (!searches && settings.before_search) SYMRIG_CHECK(settings.before_search());
  return stoppable(settings.work, [&]() -> Result<CaptureResult> {
    if (small) return acquisition::capture_brute(probe, settings);
    if (settings.unchecked || !searches) return algorithm.run(probe, settings);
    return run_watched(probe, settings, algorithm);
  });
}

}  // namespace symrig
