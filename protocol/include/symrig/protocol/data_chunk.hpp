// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/frame.hpp"

namespace symrig::protocol {

constexpr size_t kChunkHeaderSize = 12;
/// Program bytes in one DATA frame: the most whole records that fit.
constexpr size_t kMaxChunk = (kMaxBody - kChunkHeaderSize) / 8 * 8;
/// The least `mtu` of a board: every request fits, and chunks are not small.
constexpr size_t kLeastMtu = 128;

/// Bytes of the longest chunk, in whole records, that a board with this `mtu` receives.
constexpr size_t chunk_room(size_t mtu) {
  constexpr size_t kAround = kHeaderSize + kChunkHeaderSize + kCrcSize;
  if (mtu < kLeastMtu) mtu = kLeastMtu;
  return mtu >= kMtu ? kMaxChunk : (mtu - kAround) / 8 * 8;
}
static_assert(chunk_room(kMtu) == kMaxChunk && chunk_room(kLeastMtu) == 104);

/// Body of a DATA frame: 12 bytes little endian (program_id:u32, offset:u32, length:u16, reserved:u16 = 0),
/// then `length` bytes of program.
struct DataChunk {
  uint32_t program_id = 0;
  uint32_t offset = 0;
  ByteView bytes;
};

/// Returns the number of written bytes, 0 if they do not fit.
inline size_t encode_chunk(const DataChunk& chunk, ByteRoom out) {
  if (chunk.bytes.size > kMaxChunk || out.size < kChunkHeaderSize + chunk.bytes.size) return 0;
  put_u32(out.data, chunk.program_id);
  put_u32(out.data + 4, chunk.offset);
  put_u16(out.data + 8, static_cast<uint16_t>(chunk.bytes.size));
  put_u16(out.data + 10, 0);
  for (size_t i = 0; i < chunk.bytes.size; ++i) out[kChunkHeaderSize + i] = chunk.bytes[i];
  return kChunkHeaderSize + chunk.bytes.size;
}

/// false: too short, the length does not match, or the reserved bytes are not zero.
inline bool decode_chunk(ByteView body, DataChunk& chunk) {
  if (body.size < kChunkHeaderSize || get_u16(body.data + 10) != 0) return false;
  if (get_u16(body.data + 8) != body.size - kChunkHeaderSize) return false;
  chunk = {get_u32(body.data), get_u32(body.data + 4), body.from(kChunkHeaderSize)};
  return true;
}

}  // namespace symrig::protocol
