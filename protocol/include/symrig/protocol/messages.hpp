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

}  // namespace symrig::protocol
