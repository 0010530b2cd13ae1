// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace symrig::projector::dlp {

/// The data of a message. Numbers have their low byte first.
using Bytes = std::vector<std::uint8_t>;

inline std::uint16_t half(const Bytes& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8U);
}

inline std::uint32_t word(const Bytes& bytes, std::size_t at) {
  return half(bytes, at) | std::uint32_t{half(bytes, at + 2)} << 16U;
}

/// Appends the lowest `count` bytes of a number.
inline void append(Bytes& bytes, std::uint32_t value, unsigned count) {
  for (unsigned k = 0; k < count; ++k) bytes.push_back(static_cast<std::uint8_t>(value >> 8U * k));
}

}  // namespace symrig::projector::dlp
