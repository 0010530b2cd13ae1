// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig.pb.h"
#include "symrig/protocol/frame.hpp"

namespace symrig::protocol {

constexpr size_t larger(size_t a, size_t b) {
  return a < b ? b : a;
}
/// Bytes of the longest message. Only DATA frames have longer bodies (kMaxBody), and boards send none.
constexpr size_t kMaxMessage =
    larger(symrig_wire_Request_size, larger(symrig_wire_Reply_size, symrig_wire_Event_size));
/// Bytes of the longest frame with a message on the wire, closing zero included.
constexpr size_t kMaxMessageWire = cobs_bound(kHeaderSize + kMaxMessage + kCrcSize) + 1;
static_assert(kMaxMessage <= kMaxBody);

/// Room for the body of any message.
struct BodyBuffer {
  uint8_t bytes[kMaxMessage];
};

// Bodies of frames. encode() returns the number of written bytes (0 for an empty message); every message
// fits. decode() overwrites the message; false: the bytes are not such a message. A decoded message is
// memory-safe, but its values may be invalid: the caller must check them, above all enums.

size_t encode(const symrig_wire_Request& message, BodyBuffer& out);
size_t encode(const symrig_wire_Reply& message, BodyBuffer& out);
size_t encode(const symrig_wire_Event& message, BodyBuffer& out);

/// The same bytes as encode() of an Event with this body, from a special encoder. Marks and edges come in
/// thousands, and the general encoder takes ten times as long on a small board.
size_t encode(const symrig_wire_StepMark& mark, BodyBuffer& out);
size_t encode(const symrig_wire_Edge& edge, BodyBuffer& out);

bool decode(ByteView body, symrig_wire_Request& message);
bool decode(ByteView body, symrig_wire_Reply& message);
bool decode(ByteView body, symrig_wire_Event& message);

/// The number of an enum field from the wire. It may differ from all enumerators, and then reading the field
/// as its own type would be undefined.
template <class Enum>
uint32_t raw(const Enum& field) {
  static_assert(sizeof(Enum) == sizeof(unsigned));  // 2 bytes where int has 16 bits
  unsigned value = 0;
  __builtin_memcpy(&value, &field, sizeof value);
  return value;
}

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

/// The answer to a host while another one uses the board: code 19 (busy) to its first request.
class BusyAnswer {
 public:
  /// Takes bytes from the host. Returns the answer when a request is complete, else nothing. The answer is
  /// valid until the next call.
  ByteView take(ByteView bytes) {
    for (size_t k = 0; k < bytes.size; ++k) {
      if (decoder_.push(bytes.data[k]) != FrameDecoder::Event::frame) continue;
      if (decoder_.frame().header.kind == Kind::request) return answer_to(decoder_.frame().header);
    }
    return {};
  }

 private:
  ByteView answer_to(const FrameHeader& request) {
    symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
    reply.code = symrig_wire_Code_CODE_BUSY;
    BodyBuffer body{};
    const size_t size = encode(reply, body);
    const auto urgent = static_cast<uint8_t>(request.flags & flag::urgent);
    // The number of an urgent request is a token, which the answer returns unchanged.
    const auto ack = static_cast<uint16_t>(urgent != 0 ? request.seq : request.seq + 1);
    return {wire_, encode_frame({kProtoMajor, Kind::reply, 0, ack, 0, urgent}, {body.bytes, size},
                                {wire_, sizeof wire_})};
  }

  FrameDecoder decoder_;
  uint8_t wire_[kMaxMessageWire] = {};
};

}  // namespace symrig::protocol
