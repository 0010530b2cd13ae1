// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5_reader/file_bytes.hpp"

#include <functional>

namespace symrig::tensor::h5 {

/// Visits the records of a B-tree of version 2.  kind: the type that the format gives to its records.
/// fails: bad_format; as `visit`.
using VisitRecord = std::function<Result<void>(Bytes record)>;
Result<void> walk_new_tree(const FileBytes& file, Address header, unsigned kind, const VisitRecord& visit);

}  // namespace symrig::tensor::h5
