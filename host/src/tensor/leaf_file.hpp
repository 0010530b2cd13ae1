// SPDX-License-Identifier: Apache-2.0
// The low-rank leaves of a scene.h5, which may stay in their file.
#pragma once

#include "tensor/leaf_parts.hpp"
#include "tensor/leaf_rules.hpp"
#include "tensor/read_tensor.hpp"

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace symrig::tensor {

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
