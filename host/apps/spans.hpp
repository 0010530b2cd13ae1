// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/ticks.hpp"

#include <string>

namespace symrig::apps {

/// "8 ns", "34.36 s": a span of a board's ticks, four significant figures.
std::string span_text(TickRate rate, Ticks ticks);

}  // namespace symrig::apps
