// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/evaluate.hpp"

#include <string>

namespace symrig::apps {

/// The errors of a tensor for a person, a line each, with what each means.
std::string error_table(const TransportErrors& errors);

}  // namespace symrig::apps
