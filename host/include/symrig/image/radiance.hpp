// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/image/image.hpp"

#include <cstdint>

namespace symrig {

/// One photograph: radiance per unit of projector light, with its uncertainty.
/// mean, variance and valid have the same grid and channels. valid is 1 where the mean can be trusted, 0
/// where no sample is usable. Where valid is 0, mean and variance are 0: test valid, never guess from the
/// numbers. mean is signed, because black subtraction may give values below zero. Clipping them would bias
/// every sum.
struct Radiance {
  Image<float> mean;
  Image<float> variance;  ///< of mean, same units squared; 0 only where the measurement is noise-free
  Image<std::uint8_t> valid;
};

}  // namespace symrig
