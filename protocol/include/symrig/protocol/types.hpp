// SPDX-License-Identifier: Apache-2.0
#pragma once

// The C headers, because tool chains of small boards have no <cstdint>.
#include <stddef.h>  // NOLINT(modernize-deprecated-headers)
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

namespace symrig::protocol {

/// A view of `size` bytes (std::span is C++20, firmware is C++17).
struct ByteView {
  const uint8_t* data = nullptr;
  size_t size = 0;

  constexpr uint8_t operator[](size_t i) const { return data[i]; }
  constexpr bool empty() const { return size == 0; }
  /// count is limited to the available bytes.
  constexpr ByteView part(size_t offset, size_t count) const {
    if (offset > size) return {};
    return {data + offset, count < size - offset ? count : size - offset};
  }
  constexpr ByteView from(size_t offset) const { return part(offset, size); }
};

/// Room for `size` bytes, owned by the caller.
struct ByteRoom {
  uint8_t* data = nullptr;
  size_t size = 0;

  constexpr uint8_t& operator[](size_t i) const { return data[i]; }
  constexpr ByteView view() const { return {data, size}; }
};

constexpr void put_u16(uint8_t* out, uint16_t value) {
  out[0] = static_cast<uint8_t>(value);
  out[1] = static_cast<uint8_t>(value >> 8U);
}
constexpr void put_u32(uint8_t* out, uint32_t value) {
  for (unsigned i = 0; i < 4; ++i) out[i] = static_cast<uint8_t>(value >> (8U * i));
}
constexpr void put_u64(uint8_t* out, uint64_t value) {
  for (unsigned i = 0; i < 8; ++i) out[i] = static_cast<uint8_t>(value >> (8U * i));
}
constexpr uint16_t get_u16(const uint8_t* in) {
  return static_cast<uint16_t>(in[0] | (in[1] << 8U));
}
constexpr uint32_t get_u32(const uint8_t* in) {
  return in[0] | (uint32_t{in[1]} << 8U) | (uint32_t{in[2]} << 16U) | (uint32_t{in[3]} << 24U);
}
constexpr uint64_t get_u64(const uint8_t* in) {
  return get_u32(in) | (uint64_t{get_u32(in + 4)} << 32U);
}

/// The number of the lowest bit that is set. bits: not 0. `long`, because int has 16 bits on small boards.
constexpr unsigned lowest_bit(uint32_t bits) {
  return static_cast<unsigned>(__builtin_ctzl(bits));
}

}  // namespace symrig::protocol
