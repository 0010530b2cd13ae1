// SPDX-License-Identifier: Apache-2.0
#include "symrig/acquisition/capture.hpp"

#include "acquisition/hierarchy.hpp"
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

RankRule default_rule(Algorithm algorithm) {
  RankRule rule;
  if (algorithm != Algorithm::symrig) return rule;
  rule.noise_sigmas = 3;
  rule.concentration = 0.8;
  return rule;
}

Economy default_economy(Algorithm algorithm) {
  Economy economy;
  if (algorithm != Algorithm::symrig) return economy;
  economy.decay = 0.05;
  economy.look_in_the_dark = true;
  economy.shrink_noise = true;
  economy.checks = true;
  economy.direct_share = 0.05;
  economy.rank = 3;
  return economy;
}

Result<CaptureResult> capture(Probe& probe, const CaptureOptions& options) {
  if (!probe.grid().valid() || probe.channels() < 1)
    return Error{ErrorCode::bad_argument, "the rig has no pixels or no channels", "check its calibration"};
  switch (options.algorithm) {
    case Algorithm::dual:
      return acquisition::capture_dual(probe, options);
    case Algorithm::brute:
      return acquisition::capture_brute(probe, options);
    case Algorithm::symrig:
    case Algorithm::paper:
      break;
  }
  return acquisition::capture_hierarchy(probe, options);
}

}  // namespace symrig
