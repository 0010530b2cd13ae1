// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/paged_vector.hpp"
#include "symrig/image/image.hpp"
#include "symrig/image/radiance.hpp"
#include "symrig/tensor/block_tree.hpp"

#include <cstdint>

namespace symrig::acquisition {

/// A photograph in tree order. mean, variance, valid: [channel][pixel].
struct TreePhotograph {
  PagedVector<float> pattern;  ///< what was lit, [pixel]
  PagedVector<float> mean, variance;
  PagedVector<std::uint8_t> valid;
};

/// Copies all but the pattern into tree order; pixels that are not valid become 0. False if a value that
/// claims to be valid is not finite.
bool to_tree(const BlockTree& tree, const Radiance& from, TreePhotograph& to);

}  // namespace symrig::acquisition
