// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/error_estimate.hpp"

#include <string>

namespace symrig::apps {

/// The errors of a tensor as text, one line for each: the value, ± half of its interval if known, and the
/// meaning. Or the reason why it is not given.
std::string error_table(const ErrorEstimate& errors);

/// Why a search gave up, and what the capture did instead.
std::string undetermined_text(const Undetermined& found);

}  // namespace symrig::apps
