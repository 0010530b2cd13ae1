// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>

namespace symrig::tensor::h5 {

/// Of HDF5's structures: Jenkins' lookup3 (hashlittle) with the initial value 0.
std::uint32_t lookup3(std::span<const std::uint8_t> bytes);

/// Of the filter fletcher32: sums of 16-bit words, high byte first, modulo 65535.
std::uint32_t fletcher32(std::span<const std::uint8_t> bytes);

}  // namespace symrig::tensor::h5
