// SPDX-License-Identifier: Apache-2.0
#include "symrig/protocol/messages.hpp"

#include <pb_decode.h>
#include <pb_encode.h>

namespace symrig::protocol {
namespace {

size_t encode_message(const pb_msgdesc_t* fields, const void* message, BodyBuffer& out) {
  pb_ostream_t stream = pb_ostream_from_buffer(out.bytes, sizeof out.bytes);
  return pb_encode(&stream, fields, message) ? stream.bytes_written : 0;
}

bool decode_message(const pb_msgdesc_t* fields, ByteView body, void* message) {
  pb_istream_t stream = pb_istream_from_buffer(body.data, body.size);
  return pb_decode(&stream, fields, message);
}

}  // namespace

namespace {

/// Writes proto3 varint fields of a message that is a member of a oneof: tag, length, fields. All field
/// numbers here are at most 15, and all fields together need less than 128 bytes.
class MemberWriter {
 public:
  MemberWriter(BodyBuffer& out, unsigned member) : out_(out) {
    out_.bytes[0] = static_cast<uint8_t>(member << 3U | 2U);
  }

  /// Does not write a zero.
  MemberWriter& field(unsigned number, uint64_t value) {
    if (value == 0) return *this;
    out_.bytes[size_++] = static_cast<uint8_t>(number << 3U);
    for (; value >= 0x80; value >>= 7U) out_.bytes[size_++] = static_cast<uint8_t>(value | 0x80U);
    out_.bytes[size_++] = static_cast<uint8_t>(value);
    return *this;
  }
  size_t finish() {
    out_.bytes[1] = static_cast<uint8_t>(size_ - 2);
    return size_;
  }

 private:
  BodyBuffer& out_;
  size_t size_ = 2;
};

}  // namespace

size_t encode(const symrig_wire_StepMark& mark, BodyBuffer& out) {
  return MemberWriter(out, symrig_wire_Event_step_mark_tag)
      .field(symrig_wire_StepMark_id_tag, mark.id)
      .field(symrig_wire_StepMark_ordinal_tag, mark.ordinal)
      .field(symrig_wire_StepMark_tick_tag, mark.tick)
      .finish();
}
size_t encode(const symrig_wire_Edge& edge, BodyBuffer& out) {
  return MemberWriter(out, symrig_wire_Event_edge_tag)
      .field(symrig_wire_Edge_line_tag, edge.line)
      .field(symrig_wire_Edge_level_tag, edge.level ? 1 : 0)
      .field(symrig_wire_Edge_tick_tag, edge.tick)
      .finish();
}

size_t encode(const symrig_wire_Request& message, BodyBuffer& out) {
  return encode_message(symrig_wire_Request_fields, &message, out);
}
size_t encode(const symrig_wire_Reply& message, BodyBuffer& out) {
  return encode_message(symrig_wire_Reply_fields, &message, out);
}
size_t encode(const symrig_wire_Event& message, BodyBuffer& out) {
  return encode_message(symrig_wire_Event_fields, &message, out);
}

bool decode(ByteView body, symrig_wire_Request& message) {
  message = symrig_wire_Request_init_zero;
  return decode_message(symrig_wire_Request_fields, body, &message);
}
bool decode(ByteView body, symrig_wire_Reply& message) {
  message = symrig_wire_Reply_init_zero;
  return decode_message(symrig_wire_Reply_fields, body, &message);
}
bool decode(ByteView body, symrig_wire_Event& message) {
  message = symrig_wire_Event_init_zero;
  return decode_message(symrig_wire_Event_fields, body, &message);
}

}  // namespace symrig::protocol
