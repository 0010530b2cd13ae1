// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5_reader/file_bytes.hpp"

#include <functional>

namespace symrig::tensor::h5 {

/// Of nodes: together they cannot be longer than their file. So a walk ends, whatever the file says.
class NodeBudget {
 public:
  explicit NodeBudget(const FileBytes& file) : left_(file.size()) {}
  /// fails: bad_format.
  Result<void> take(std::string_view structure, Address at, std::uint64_t size) {
    if (size > left_) return damaged_at(structure, at, "is longer than the file");
    left_ -= size;
    return {};
  }

 private:
  std::uint64_t left_;
};

/// Visits the entries of a B-tree of version 1: of a group (kind 0: what children are is up to the caller) or
/// of chunks (kind 1).  key: the one before the child.  fails: bad_format; as `visit`.
using VisitOldEntry = std::function<Result<void>(Bytes key, Address child)>;
Result<void> walk_old_tree(const FileBytes& file, Address root, unsigned kind, std::uint64_t key_bytes,
                           const VisitOldEntry& visit);

/// Visits the records of a B-tree of version 2.  kind: the type that the format gives to its records.
/// fails: bad_format; as `visit`.
using VisitRecord = std::function<Result<void>(Bytes record)>;
Result<void> walk_new_tree(const FileBytes& file, Address header, unsigned kind, const VisitRecord& visit);

}  // namespace symrig::tensor::h5
