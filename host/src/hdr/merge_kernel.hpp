// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace symrig::hdr {

/// Constants of one bracket, with time in units of its longest exposure T: t ∈ (0, 1], and noise in codes.
struct BracketConstants {
  std::size_t frames = 0;
  float pedestal = 0;            ///< [DN]
  float saturation = 0;          ///< [DN]
  float electrons_per_code = 0;  ///< 1 / gain
  float scale = 0;               ///< radiance per electron per T
  float lowest_rate = 0;         ///< half the floor variance of the longest exposure, negative [DN per T]
  std::array<float, kMaxFrames> time{};   ///< t_k
  std::array<float, kMaxFrames> floor{};  ///< gain · floor variance / t_k  [DN e⁻ per T]
};

/// One range of pixels. raw: one pointer for each frame. The other pointers are never null.
struct MergeRange {
  std::array<const std::uint16_t*, kMaxFrames> raw{};
  const float* black = nullptr;
  const float* black_variance = nullptr;
  const std::uint8_t* black_valid = nullptr;
  const std::uint8_t* dead = nullptr;
  float* mean = nullptr;
  float* variance = nullptr;
  std::uint8_t* valid = nullptr;
  std::size_t count = 0;
};

/// How the kernel writes its results.
enum class Stores : std::uint8_t {
  cached,    ///< for photographs that are read again while they are in the cache
  streamed,  ///< bypasses the cache: the lines are not read first, which saves a third of the memory traffic
};

/// Merges one range. Does not allocate. Gives the same bits on every instruction set (no fused multiply-add,
/// true divisions) and for both kinds of stores. False if black or its variance contains NaN or infinity; the
/// outputs are then not valid.
bool merge_range(const BracketConstants& bracket, const MergeRange& range, Stores stores) noexcept;

/// The sums to which a frame is added, `count` values each.
struct StreamSums {
  float* sum;            ///< Σ d
  float* time;           ///< Σ t
  float* weighted_sum;   ///< Σ t d
  float* weighted_time;  ///< Σ t²
};

/// Adds the samples of one frame below `saturation`. Gives the same bits on every instruction set.
void add_frame(const std::uint16_t* raw, std::size_t count, float pedestal, float saturation, float t,
               const StreamSums& into) noexcept;

}  // namespace symrig::hdr
