// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tensor/h5.hpp"

#include <cstdint>
#include <filesystem>

namespace symrig::tensor::h5 {

/// Where HDF5 writes a new file. The library cannot end a file whose writing failed: it would end the
/// process. So its driver tells it that all is well, and remembers the first failure.
struct Output {
  int cause = 0;  ///< errno of the first failure, or 0
};

/// Creates a file that is written through `output`, which must outlive it. Metadata stay in memory until the
/// file is closed. Not ok() if it cannot be created: `output` has the cause.
Handle create_file(const std::filesystem::path& path, Output& output);

}  // namespace symrig::tensor::h5
