// SPDX-License-Identifier: Apache-2.0
// Shared by writing and reading of scene.h5.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/tensor/block_tree.hpp"
#include "tensor/h5.hpp"
#include "tensor/h5_read.hpp"

#include <cstdint>
#include <string>

namespace symrig::tensor {

constexpr std::int32_t kVersionMajor = 2;  ///< version 1 can also be read
constexpr std::int32_t kVersionMinor = 0;

/// Writes the tree of one side ("camera" or "projector"): dataset <side>_order, and for a grid of several
/// views the attributes <side>_views, <side>_split and, unless flat, the dataset <side>_boundaries.
bool write_tree(hid_t file, const std::string& side, const BlockTree& tree);

/// The inverse of write_tree(). Without <side>_split the tree is the flat tree of one view.
/// fails: bad_format (missing, damaged, or not a tree).
Result<BlockTree> read_tree(const h5::Object& file, const std::string& side, Grid grid);

}  // namespace symrig::tensor
