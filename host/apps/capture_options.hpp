// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/base/result.hpp"

#include <optional>

namespace symrig::apps {

/// What `--algorithm` and `--tolerance` mean, in every command that captures.
/// tolerance: detail to stop at as a share of the RMS of the flood-lit photograph; empty is the algorithm's
/// own. dual takes it as its threshold; brute force has none.
CaptureOptions options_for(Algorithm algorithm, std::optional<double> tolerance);

/// The tolerance that an algorithm runs with unless told otherwise; nothing for brute force.
std::optional<double> default_tolerance(Algorithm algorithm);

/// fails: bad_argument (naming the option) unless 0 < value < 1. Nothing given is right.
Result<void> check_share(const char* option, const std::optional<double>& value);

}  // namespace symrig::apps
