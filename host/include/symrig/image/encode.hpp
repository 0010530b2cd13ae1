// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/image/image.hpp"

#include <cstddef>
#include <vector>

namespace symrig {

/// The bytes of the OpenEXR file that write_image would write: 32-bit float, ZIP, 1 or 3 channels.
/// fails: bad_argument (empty, other channels), io.
Result<std::vector<std::byte>> encode_exr(const Image<float>& image);

}  // namespace symrig
