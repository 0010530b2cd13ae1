// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/camera/camera.hpp"

#include <algorithm>
#include <cstddef>
#include <span>

namespace symrig {

/// The largest value of a frame, without dead pixels. values: planes of the camera's grid.
template <class T>
double largest_live(std::span<const T> values, const Camera& camera) {
  const std::size_t pixels = camera.grid().size();
  const Image<std::uint8_t>* dead = camera.dead();
  double largest = 0;
  for (std::size_t i = 0; i < values.size(); ++i)
    if (dead == nullptr || dead->values()[i % pixels] == 0)
      largest = std::max(largest, static_cast<double>(values[i]));
  return largest;
}

}  // namespace symrig
