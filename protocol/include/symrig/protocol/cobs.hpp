// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

/// Bytes that `size` bytes take after COBS, without the closing zero: one more for every 254 begun.
constexpr size_t cobs_bound(size_t size) {
  return size + size / 254 + 1;
}

/// Consistent overhead byte stuffing [Cheshire and Baker 1999]: the output holds no zero byte.
/// Returns the bytes written, 0 if `out` is too small (cobs_bound(in.size) always suffices). in and out do
/// not overlap.
constexpr size_t cobs_encode(ByteView in, ByteRoom out) {
  if (out.size < cobs_bound(in.size)) return 0;
  size_t code_at = 0;
  size_t written = 1;
  uint8_t code = 1;
  for (size_t i = 0; i < in.size; ++i) {
    if (in[i] != 0) {
      out[written++] = in[i];
      ++code;
    }
    // A full block of 254 ends by itself; at the end of the input it needs no empty block after it.
    if (in[i] == 0 || (code == 0xFF && i + 1 < in.size)) {
      out[code_at] = code;
      code_at = written++;
      code = 1;
    }
  }
  out[code_at] = code;
  return written;
}

}  // namespace symrig::protocol
