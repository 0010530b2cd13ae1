// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "acquisition/algorithms.hpp"

namespace symrig {
namespace {

/// The flood-lit photograph, six held-out ones and three levels are as many as brute force takes: no search
/// saves any. With a budget there is still something to choose.
bool too_small_to_search(Grid grid, const CaptureSettings& settings) {
  constexpr std::int64_t kPixels = 64;
  return algorithm_info(settings.algorithm).yields_to_brute_force && grid.size() < kPixels &&
         settings.max_patterns == 0 && settings.max_seconds == 0 && settings.target_error == 0;
}

}  // namespace

Result<CaptureResult> capture(Probe& probe, const CaptureOptions& options) {
  SYMRIG_TRY(const CaptureSettings settings, settings_of(options));
  if (!probe.grid().valid() || probe.channels() < 1)
    return Error{ErrorCode::bad_argument, "the rig has no pixels or no channels", "check its calibration"};
  SYMRIG_CHECK(check_aligned(probe));
  // With a log this has been asked of the rig itself: a log that is continued plans no exposures, whatever
  // the rig does.
  if (settings.log == nullptr) SYMRIG_CHECK(check_rig(options, probe));
  const auto run = too_small_to_search(probe.grid(), settings) ? acquisition::capture_brute
                                                               : algorithm_info(settings.algorithm).run;
  return stoppable(settings.work, [&] { return run(probe, settings); });
}

}  // namespace symrig
