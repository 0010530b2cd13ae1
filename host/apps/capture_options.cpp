// SPDX-License-Identifier: Apache-2.0
#include "capture_options.hpp"

#include <cmath>

#include <fmt/format.h>

namespace symrig::apps {

CaptureOptions options_for(Algorithm algorithm, std::optional<double> tolerance) {
  CaptureOptions options;
  options.algorithm = algorithm;
  options.rule = default_rule(algorithm);
  options.economy = default_economy(algorithm);
  if (!tolerance) return options;
  options.rule.flood_fraction = options.rule.empty_fraction = *tolerance;
  if (algorithm == Algorithm::dual) options.dual_threshold = *tolerance;
  return options;
}

std::optional<double> default_tolerance(Algorithm algorithm) {
  const CaptureOptions options = options_for(algorithm, {});
  if (algorithm == Algorithm::brute) return std::nullopt;
  return algorithm == Algorithm::dual ? options.dual_threshold : options.rule.flood_fraction;
}

Result<void> check_share(const char* option, const std::optional<double>& value) {
  if (!value || (std::isfinite(*value) && *value > 0 && *value < 1)) return {};
  return Error{ErrorCode::bad_argument,
               fmt::format("{} {} is not a share of the flood-lit signal", option, *value),
               "give a number above 0 and below 1, such as 3e-4"};
}

}  // namespace symrig::apps
