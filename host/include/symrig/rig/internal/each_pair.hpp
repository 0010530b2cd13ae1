// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"

#include <cstddef>
#include <functional>

namespace symrig::rig {

/// Calls `each` for all pairs at the same time, each in a thread of its own: they wait for devices, and a
/// pair behind a socket computes meanwhile. Returns the first pair's error, which then names the pair.
Result<void> for_each_pair(std::size_t pairs, const std::function<Result<void>(std::size_t pair)>& each);

/// "pair 2: " before the error.
Error of_pair(std::size_t pair, Error error);

}  // namespace symrig::rig
