// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/hdr/response.hpp"

#include <filesystem>

namespace symrig {

/// A TOML table [response] with the light of every code (docs/sensor.md). Written atomically.  fails: io.
Result<void> save_response(const std::filesystem::path& path, const ResponseCurve& curve);
/// fails: not_found, io, bad_format (file:line; a number of codes that no camera has, or light that does not
/// rise from 0 to 1).
Result<ResponseCurve> load_response(const std::filesystem::path& path);

}  // namespace symrig
