// SPDX-License-Identifier: Apache-2.0
// Reading the tensor of a scene.h5, datasets in order: nothing is used before it was checked.
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/tensor/transport_tensor.hpp"
#include "tensor/h5.hpp"

#include <cstdint>
#include <string>

namespace symrig::scene_file {

/// An open scene file and its size, against which every claimed size is checked.
struct Source {
  h5::Handle file;
  std::uint64_t bytes;
};

/// What the root attributes say.
struct Head {
  std::int32_t version;  ///< 1 or 2
  bool symmetric;
  int channels;
  Grid camera, projector;
};

Error damaged(const std::string& what);
Error not_finite(const std::string& what);
bool all_finite(std::span<const float> values);

/// Reads every part of T into the builder. fails: bad_format, bad_value.
Result<void> read_tensor(const Source& source, const Head& head, const BlockTree& camera,
                         const BlockTree& projector, TensorBuilder& builder);

}  // namespace symrig::scene_file
