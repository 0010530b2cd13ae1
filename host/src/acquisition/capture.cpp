// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "acquisition/algorithms.hpp"
#include "acquisition/light/light_witness.hpp"

#include <utility>

namespace symrig {
namespace {

/// The flood-lit photograph, six held-out ones and three levels are as many as brute force takes: no search
/// saves any. With a budget there is still something to choose.
bool too_small_to_search(Grid grid, const CaptureSettings& settings) {
  constexpr std::int64_t kPixels = 64;
  return algorithm_info(settings.algorithm).yields_to_brute_force && grid.size() < kPixels &&
         settings.max_patterns == 0 && settings.max_seconds == 0 && settings.target_error == 0;
}

/// A search that finds nothing to rely on is a reason to ask whether the rig is still the same.
Result<CaptureResult> run_watched(Probe& probe, CaptureSettings settings, const AlgorithmInfo& algorithm) {
  if (!settings.look_aside && settings.log == nullptr)
    settings.look_aside = [&probe](std::span<const Pattern> patterns) { return probe.measure(patterns); };
  acquisition::LightWitness witness(probe, settings.look_aside);
  SYMRIG_TRY(CaptureResult result, algorithm.run(witness, settings));
  constexpr std::int64_t kLooks = acquisition::LightWitness::kLooksAgain;
  const bool spare = settings.max_seconds == 0 &&
                     (settings.max_patterns == 0 || result.patterns + kLooks <= settings.max_patterns);
  if (result.undetermined && spare) SYMRIG_CHECK(witness.look_again());
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
