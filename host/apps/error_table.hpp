// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/error_estimate.hpp"

#include <string>

namespace symrig::apps {

/// The errors of a tensor for a person, a line each: value, ± half of its interval where it has one, what it
/// means; or why it is not given.
std::string error_table(const ErrorEstimate& errors);

}  // namespace symrig::apps
