// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/calibration/registration.hpp"

#include <filesystem>

namespace symrig {

/// Writes registration.h5 (HDF5, docs/registration-file.md) atomically.
/// fails: io, not_found.
Result<void> save_registration(const std::filesystem::path& path, const Registration& registration);

/// Reads registration.h5. Checks version, sizes and every number before it uses them.
/// fails: not_found, io, bad_format, bad_value.
Result<Registration> load_registration(const std::filesystem::path& path);

}  // namespace symrig
