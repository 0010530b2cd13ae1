// SPDX-License-Identifier: Apache-2.0
// The low-rank leaves of a scene.h5: the rules of docs/file-format.md for them, and those that stay in their
// file.
#pragma once

#include "tensor/leaf_parts.hpp"
#include "tensor/scene_file.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace symrig::tensor {

struct Trees {
  const BlockTree* camera;
  const BlockTree* projector;

  int levels() const { return std::max(camera->levels(), projector->levels()); }
  /// The number of blocks of a level; 0 after the tree's last level.
  static std::int64_t blocks(const BlockTree& tree, int level) {
    return level < tree.levels() ? std::ssize(tree.level(level)) : 0;
  }
};

bool range_ok(std::int32_t begin, std::int32_t end, std::int64_t size);
/// The largest magnitude of finite values; 0 if there are none.
float largest_of(std::span<const float> values);

/// True if the leaf's ranges, rank and level fit the grids, the trees and, if symmetric, its mirror image.
bool leaf_in_place(const Leaf& leaf, const Head& head, const Trees& trees);

/// True if the leaf's factors (all channels, scaled) give only entries below kLargest. On the diagonal of a
/// symmetric file they must also give a symmetric block.
bool leaf_values_ok(std::span<const float> factors, const Leaf& leaf, const Head& head);

// The low-rank leaves of a scene.h5, which may stay in their file.

/// Ranges, ranks and levels of all leaves, checked against its trees and against the
/// sizes of `leaves/factors` and `leaves/exponents`. No factor is read.
/// fails: bad_format.
Result<std::vector<Leaf>> read_leaf_list(const Object& file, const Head& head, const Trees& trees);

/// The error of a leaf that is not as docs/file-format.md says.
Error breaks_rules(std::size_t leaf);

/// Reads parts of an open file, and checks them. Several threads may call it.
class LeafReader {
 public:
  LeafReader(Object file, const Head& head) : file_(std::move(file)), head_(head) {}

  /// leaves: those of the part.  fails: bad_format, bad_value.
  Result<void> read(const PartRange& part, std::span<const Leaf> leaves, PartValues& to) const;

 private:
  Object file_;
  Head head_;
};

/// The same for a file that stays open: another one that takes its name later is not read.
class LeafFile {
 public:
  /// path: for messages.
  LeafFile(const Object& file, std::string path, const Head& head)
      : path_(std::move(path)), reader_(file, head) {}

  /// Errors name the file. Several threads may call it.
  Result<void> read(const PartRange& part, std::span<const Leaf> leaves, PartValues& to) const;

 private:
  std::string path_;
  LeafReader reader_;
};

}  // namespace symrig::tensor
