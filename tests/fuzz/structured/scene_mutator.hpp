// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/random.hpp"

#include <filesystem>
#include <string>

namespace symrig::structured {

/// Changes one to three things in a scene file by way of the HDF5 library, which makes all checksums right
/// again: values, shapes, types, texts; things are deleted, doubled, or linked to elsewhere. What was done.
std::string mutate_scene(const std::filesystem::path& file, Random& random);

}  // namespace symrig::structured
