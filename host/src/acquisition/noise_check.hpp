// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "acquisition/tree_photograph.hpp"
#include "symrig/acquisition/noise_check.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <span>

namespace symrig::acquisition {

/// floods: photographs of all pixels lit; half, other: photographs of a pattern and its complement, or none.
/// [decisions/error-estimates.md]
NoiseCheck check_noise(const BlockTree& tree, std::span<const TreePhotograph> floods,
                       const TreePhotograph* half, const TreePhotograph* other);

/// By how much estimates should doubt the stated variance: 1 where nothing was found.
double doubted_variance(const NoiseCheck& check);

}  // namespace symrig::acquisition
