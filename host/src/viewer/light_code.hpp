// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// Lights and pictures on the wire between page and server. Browsers send large bodies slowly, and most of a
/// light is dark. All numbers are little-endian; a half is an IEEE 754 binary16.
namespace symrig::viewer {

/// The largest light of a grid. units: bytes.
std::uint64_t most_light_bytes(Grid grid);

/// A light: the number of planes (1 or 3); for each plane the number of runs, the first pixel and the length
/// of each run, in 32 bits each, then the halves of all runs, padded to 4 bytes. Pixels outside the runs are
/// dark. Nothing if the bytes are no finite light of this grid.
std::optional<std::vector<Image<float>>> decode_light(std::string_view bytes, Grid grid);

/// Appends a plane of a picture: an exponent of 32 bits, then halves, padded to 4 bytes.
/// value = half · 2^exponent.  error: ≤ 2⁻¹¹ |value| + 2⁻³² of the largest value.
void append_plane(std::string& to, std::span<const float> values);

}  // namespace symrig::viewer
