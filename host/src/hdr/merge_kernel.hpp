// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hdr/merge.hpp"

#include <array>
#include <cstddef>
#include <cstdint>

namespace symrig::hdr {

/// Constants of one bracket, with time in units of its longest exposure T: t ∈ (0, 1].
struct BracketConstants {
  std::size_t frames = 0;
  float pedestal = 0;            ///< [DN]
  float saturation = 0;          ///< [DN]
  float electrons_per_code = 0;  ///< 1 / gain
  float scale = 0;               ///< radiance per electron per T
  float lowest_rate = 0;         ///< half the floor variance of the longest exposure, negative [e⁻ per T]
  std::array<float, kMaxFrames> time{};      ///< t_k
  std::array<float, kMaxFrames> floor{};     ///< floor variance / t_k  [e⁻² per T]
  std::array<float, kMaxFrames> per_code{};  ///< 1 / (gain t_k): electrons per T that one code means
};

/// One range of pixels. raw: one pointer a frame. black, black_variance, black_valid: never null.
struct MergeRange {
  std::array<const std::uint16_t*, kMaxFrames> raw{};
  const float* black = nullptr;
  const float* black_variance = nullptr;
  const std::uint8_t* black_valid = nullptr;
  float* mean = nullptr;
  float* variance = nullptr;
  std::uint8_t* valid = nullptr;
  std::size_t count = 0;
};

/// Merges one range. No allocation, no policy; the same bits on every instruction set (no fused multiply-add,
/// true divisions). False if black or its variance holds NaN or infinity (the outputs are then of no use).
bool merge_range(const BracketConstants& bracket, const MergeRange& range) noexcept;

}  // namespace symrig::hdr
