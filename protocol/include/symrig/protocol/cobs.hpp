// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

/// The size of `size` bytes after COBS, without the closing zero: one more byte for each started 254.
constexpr size_t cobs_bound(size_t size) {
  return size + size / 254 + 1;
}

/// Consistent overhead byte stuffing [Cheshire and Baker 1999], a byte at a time. The output contains no zero
/// byte.
class CobsWriter {
 public:
  /// out needs room for cobs_bound(number of bytes), and must not overlap with the input.
  constexpr explicit CobsWriter(uint8_t* out) : out_(out) {}

  constexpr void add(uint8_t byte) {
    // A full block of 254 ends by itself. At the end of the input no empty block follows it.
    if (code_ == 0xFF) next_block();
    if (byte == 0) return next_block();
    out_[written_++] = byte;
    ++code_;
  }
  constexpr void add(ByteView bytes) {
    for (size_t i = 0; i < bytes.size; ++i) add(bytes[i]);
  }
  /// Returns the number of written bytes.
  constexpr size_t finish() {
    out_[code_at_] = code_;
    return written_;
  }

 private:
  constexpr void next_block() {
    out_[code_at_] = code_;
    code_at_ = written_++;
    code_ = 1;
  }

  uint8_t* out_;
  size_t code_at_ = 0;
  size_t written_ = 1;
  uint8_t code_ = 1;
};

/// Encodes all bytes. Returns the number of written bytes, 0 if `out` is too small (cobs_bound(in.size)
/// always suffices). in and out must not overlap.
constexpr size_t cobs_encode(ByteView in, ByteRoom out) {
  if (out.size < cobs_bound(in.size)) return 0;
  CobsWriter writer(out.data);
  writer.add(in);
  return writer.finish();
}

}  // namespace symrig::protocol
