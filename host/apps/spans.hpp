// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/device/ticks.hpp"

#include <string>

namespace symrig::apps {

/// "8 ns", "34.36 s": a span of a board's ticks, four significant figures.
std::string span_text(device::TickRate rate, device::Ticks ticks);

}  // namespace symrig::apps
