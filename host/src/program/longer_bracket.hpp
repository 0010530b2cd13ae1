// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/time.hpp"

#include <functional>
#include <vector>

namespace symrig::program {

/// Makes one exposure legal. The result is never shorter than the shortest legal exposure.
using Legalize = std::function<Nanoseconds(Nanoseconds)>;

/// A legal bracket in the same order, with as many different exposures as possible. Each exposure is made
/// legal by itself. If this makes some equal, all are first multiplied by one factor, so that the shortest is
/// `least`: equal exposures add no range. Exposures that are still equal appear once.
std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least,
                                        const Legalize& legalize);

/// The same if every exposure of at least `least` is legal.
std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least);

}  // namespace symrig::program
