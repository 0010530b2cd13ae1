// SPDX-License-Identifier: Apache-2.0
// Reads the tensor of a scene.h5. Every value is checked before it is used.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/file_values.hpp"
#include "tensor/h5_file.hpp"

#include <cstdint>
#include <filesystem>
#include <string>

namespace symrig::tensor {

using h5::Object;

/// The root attributes.
struct Head {
  std::int32_t version;  ///< 1 or 2
  bool symmetric;
  int channels;
  Grid camera, projector;
};

/// An attribute that counts the groups "0", "1", … of the group `groups`. fails: bad_format (negative, or
/// there is one more).
Result<std::int32_t> read_count(const Object& file, const char* attribute, const std::string& groups);

/// Where the factors of leaves are kept.
struct KeepLeaves {
  std::int64_t bytes;          ///< more than that stay in the file
  std::filesystem::path path;  ///< of the file, for messages
};

/// Reads every part of T into the builder. fails: bad_format, bad_value.
Result<void> read_tensor(const Object& file, const Head& head, const BlockTree& camera,
                         const BlockTree& projector, const KeepLeaves& keep, TensorBuilder& builder);

}  // namespace symrig::tensor
