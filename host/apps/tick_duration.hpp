// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/board/ticks.hpp"

#include <string>

namespace symrig::apps {

/// A number of board ticks as a duration with four significant figures: "8 ns", "34.36 s".
std::string tick_duration_text(TickRate rate, Ticks ticks);

}  // namespace symrig::apps
