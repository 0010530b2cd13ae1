// SPDX-License-Identifier: Apache-2.0
// What writing and reading scene.h5 share.
#pragma once

#include "symrig/base/result.hpp"

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <mutex>

namespace symrig::scene_file {

constexpr std::int32_t kVersionMajor = 2;  ///< and 1 can be read
constexpr std::int32_t kVersionMinor = 0;

/// HDF5 as Debian builds it is not thread-safe: one scene file at a time.
inline std::mutex& hdf5_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace symrig::scene_file
