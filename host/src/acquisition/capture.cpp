// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "acquisition/search/hierarchy.hpp"
#include "symrig/base/nearest_name.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace symrig {
namespace {

constexpr std::array<std::pair<Algorithm, std::string_view>, 4> kAlgorithms{{{Algorithm::symrig, "symrig"},
                                                                             {Algorithm::paper, "paper"},
                                                                             {Algorithm::dual, "dual"},
                                                                             {Algorithm::brute, "brute"}}};

}  // namespace

std::string_view name(Algorithm algorithm) {
  for (const auto& [value, text] : kAlgorithms)
    if (value == algorithm) return text;
  return "unknown";
}

std::span<const std::string_view> algorithm_names() {
  static const auto names = [] {
    std::array<std::string_view, kAlgorithms.size()> list;
    std::transform(kAlgorithms.begin(), kAlgorithms.end(), list.begin(),
                   [](const auto& algorithm) { return algorithm.second; });
    return list;
  }();
  return names;
}

Result<Algorithm> parse_algorithm(std::string_view text) {
  for (const auto& [value, known] : kAlgorithms)
    if (known == text) return value;
  return Error{ErrorCode::unknown_name, "no algorithm '" + std::string(text) + "'",
               nearest_hint(text, algorithm_names())};
}

namespace {

/// The flood-lit photograph, six held-out ones and three levels are as many as brute force takes: no search
/// saves any. With a budget there is still something to choose.
bool too_small_to_search(Grid grid, const CaptureSettings& settings) {
  constexpr std::int64_t kPixels = 64;
  return settings.algorithm == Algorithm::symrig && grid.size() < kPixels && settings.max_patterns == 0 &&
         settings.max_seconds == 0 && settings.target_error == 0;
}

}  // namespace

Result<CaptureResult> capture(Probe& probe, const CaptureOptions& options) {
  SYMRIG_TRY(const CaptureSettings settings, settings_of(options));
  if (!probe.grid().valid() || probe.channels() < 1)
    return Error{ErrorCode::bad_argument, "the rig has no pixels or no channels", "check its calibration"};
  // With a log this has been asked of the rig itself: a log that is continued plans no exposures, whatever
  // the rig does.
  if (settings.log == nullptr) SYMRIG_CHECK(check_rig(options, probe));
  if (too_small_to_search(probe.grid(), settings)) return acquisition::capture_brute(probe, settings);
  switch (settings.algorithm) {
    case Algorithm::dual:
      return acquisition::capture_dual(probe, settings);
    case Algorithm::brute:
      return acquisition::capture_brute(probe, settings);
    case Algorithm::symrig:
    case Algorithm::paper:
      break;
  }
  return acquisition::capture_hierarchy(probe, settings);
}

}  // namespace symrig
