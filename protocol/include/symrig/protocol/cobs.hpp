// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/types.hpp"

namespace symrig::protocol {

/// Bytes that `size` bytes take after COBS, without the closing zero: one more for every 254 begun.
constexpr size_t cobs_bound(size_t size) {
  return size + size / 254 + 1;
}

/// Consistent overhead byte stuffing [Cheshire and Baker 1999], a byte at a time: the output holds no zero
/// byte.
class CobsWriter {
 public:
  /// out has room for cobs_bound(bytes to come) and does not overlap with them.
  constexpr explicit CobsWriter(uint8_t* out) : out_(out) {}

  constexpr void add(uint8_t byte) {
    // A full block of 254 ends by itself; at the end of the input it needs no empty block after it.
    if (code_ == 0xFF) next_block();
    if (byte == 0) return next_block();
    out_[written_++] = byte;
    ++code_;
  }
  constexpr void add(ByteView bytes) {
    for (size_t i = 0; i < bytes.size; ++i) add(bytes[i]);
  }
  /// Returns the bytes written.
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

/// All at once. Returns the bytes written, 0 if `out` is too small (cobs_bound(in.size) always suffices). in
/// and out do not overlap.
constexpr size_t cobs_encode(ByteView in, ByteRoom out) {
  if (out.size < cobs_bound(in.size)) return 0;
  CobsWriter writer(out.data);
  writer.add(in);
  return writer.finish();
}

}  // namespace symrig::protocol
