// SPDX-License-Identifier: Apache-2.0
// The request "develop" of a simulated pair, as bytes (docs/pair-protocol.md).
#pragma once

#include "sim/image_source.hpp"
#include "symrig/base/result.hpp"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace symrig::sim {

inline constexpr std::size_t kMostPatterns = 64;    // of one request
inline constexpr std::size_t kMostExposures = 256;  // of one request
inline constexpr double kLongestExposure = 86'400;  // seconds

/// "develop PATTERNS EXPOSURES".
struct DevelopHeader {
  std::size_t patterns = 0, exposures = 0;
};
/// none: not such a line, or too many.
std::optional<DevelopHeader> parse_develop(std::string_view line);

/// What follows the header.
std::vector<std::byte> encode_develop(std::span<const LitPattern> patterns,
                                      std::span<const LitExposure> exposures);

/// The fixed part of an exposure; its shares follow.
struct ExposureHead {
  double seconds = 0;
  std::uint64_t noise = 0;
  std::uint64_t shares = 0;
};
struct ShareRecord {
  std::uint64_t pattern = 0;
  double share = 0;
};

/// Bytes of a frame with these values.
std::size_t frame_bytes(bool noisy, std::int64_t values);

}  // namespace symrig::sim
