// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/units.hpp"

#include <functional>
#include <vector>

namespace symrig::program {

/// How one exposure becomes legal: never shorter than the shortest legal one.
using Legalize = std::function<Nanoseconds(Nanoseconds)>;

/// A bracket that is legal, has as many different exposures as the one given where that is possible, and
/// keeps its order. Each exposure is made legal by itself. Where that makes some equal, all are first made
/// longer in one ratio, so that the shortest is `least`: a bracket of equal exposures sees no more than one
/// of them. Exposures that are equal nevertheless stand there once.
std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least,
                                        const Legalize& legalize);

/// The same where only the shortest is limited.
std::vector<Nanoseconds> longer_bracket(const std::vector<Nanoseconds>& bracket, Nanoseconds least);

}  // namespace symrig::program
