// SPDX-License-Identifier: Apache-2.0
// Shared by writing and reading of scene.h5.
#pragma once

#include "symrig/base/result.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <mutex>

namespace symrig::tensor {

constexpr std::int32_t kVersionMajor = 2;  ///< version 1 can also be read
constexpr std::int32_t kVersionMinor = 0;

/// Debian's HDF5 is not thread-safe: only one scene file at a time.
inline std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace symrig::tensor
