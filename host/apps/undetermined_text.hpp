// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/acquisition/capture.hpp"

#include <string>

namespace symrig::apps {

/// Why a search gave up, and what the capture did instead.
std::string undetermined_text(const Undetermined& found);

}  // namespace symrig::apps
