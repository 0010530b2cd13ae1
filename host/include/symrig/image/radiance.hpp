// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <cstdint>

namespace symrig {

/// One photograph: radiance per unit of projector light, with what is known of its error.
/// mean and variance have the same grid and channels; valid has them too (1 = the mean can be trusted, 0 = no
/// usable sample). Where valid is 0, mean is 0 and variance is 0: consumers must test valid, never guess from
/// the numbers. mean is signed: black subtraction may leave it below zero, and clipping it would bias every
/// sum.
struct Radiance {
  Image<float> mean;
  Image<float> variance;  ///< of mean, same units squared; 0 only where the measurement is noise-free
  Image<std::uint8_t> valid;
};

}  // namespace symrig
