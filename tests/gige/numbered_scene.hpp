// SPDX-License-Identifier: Apache-2.0
// Pictures that tell which trigger they are of.
#pragma once

#include "gige/gige_camera.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>

namespace symrig::gige {

/// The first pixel is the trigger's count, the second the exposure in µs, the rest depend on both and on the
/// place, so any mixture of two pictures is found.
inline std::uint16_t numbered_code(const Shot& shot, std::size_t k) {
  if (k == 0) return static_cast<std::uint16_t>(shot.counter);
  if (k == 1) return static_cast<std::uint16_t>(shot.exposure / std::chrono::microseconds(1));
  return static_cast<std::uint16_t>(2654435761U * (shot.counter + 77U * static_cast<unsigned>(k)) >> 16U);
}

inline void numbered_scene(const Shot& shot, std::span<std::uint16_t> codes) {
  for (std::size_t k = 0; k < codes.size(); ++k) codes[k] = numbered_code(shot, k);
}

/// All pixels are those of this trigger and exposure.
inline bool shows(std::span<const std::uint16_t> codes, std::uint32_t counter,
                  std::chrono::nanoseconds exposure) {
  Shot shot;
  shot.counter = counter;
  shot.exposure = exposure;
  for (std::size_t k = 0; k < codes.size(); ++k)
    if (codes[k] != numbered_code(shot, k)) return false;
  return !codes.empty();
}

}  // namespace symrig::gige
