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

namespace {

struct Member {
  pb_size_t tag;
  const pb_msgdesc_t* fields;
};
constexpr Member kReplyMembers[] = {
    {symrig_wire_Reply_hello_tag, symrig_wire_HelloReply_fields},
    {symrig_wire_Reply_capabilities_tag, symrig_wire_CapabilitiesReply_fields},
    {symrig_wire_Reply_line_tag, symrig_wire_LineReply_fields},
    {symrig_wire_Reply_commit_tag, symrig_wire_CommitReply_fields},
    {symrig_wire_Reply_status_tag, symrig_wire_StatusReply_fields},
    {symrig_wire_Reply_time_tag, symrig_wire_TimeReply_fields},
    {symrig_wire_Reply_violation_tag, symrig_wire_Violation_fields},
    {symrig_wire_Reply_line_use_tag, symrig_wire_LineUse_fields},
    {symrig_wire_Reply_diagnostics_tag, symrig_wire_DiagnosticsReply_fields}};

uint8_t* put_varint(uint8_t* at, uint64_t value) {
  for (; value >= 0x80; value >>= 7U) *at++ = static_cast<uint8_t>(value | 0x80U);
  *at++ = static_cast<uint8_t>(value);
  return at;
}

/// Does not write a zero. number: at most 15.
uint8_t* put_field(uint8_t* at, unsigned number, uint64_t value) {
  if (value == 0) return at;
  *at++ = static_cast<uint8_t>(number << 3U);
  return put_varint(at, value);
}

/// The member's content goes behind the longest possible tag and length, and then up to them. nullptr: it
/// does not fit.
uint8_t* put_member(uint8_t* at, const uint8_t* end, const Member& member, const void* content) {
  constexpr uint8_t kHead = 3;
  pb_ostream_t stream = pb_ostream_from_buffer(at + kHead, static_cast<size_t>(end - at) - kHead);
  if (!pb_encode(&stream, member.fields, content)) return nullptr;
  *at = static_cast<uint8_t>(member.tag << 3U | 2U);
  const uint8_t* from = at + kHead;
  uint8_t* to = put_varint(at + 1, stream.bytes_written);
  for (size_t i = 0; i < stream.bytes_written; ++i) *to++ = *from++;
  return to;
}

}  // namespace

/// nanopb encodes a member twice, because it needs the length first. That was the longest part of a round of
/// a small board's main loop.
size_t encode(const symrig_wire_Reply& message, BodyBuffer& out) {
  uint8_t* at = put_field(out.bytes, symrig_wire_Reply_code_tag, raw(message.code));
  at = put_field(at, symrig_wire_Reply_field_tag, message.field);
  at = put_field(at, symrig_wire_Reply_detail_tag, message.detail);
  for (const Member& member : kReplyMembers) {
    if (member.tag != message.which_body) continue;
    at = put_member(at, out.bytes + sizeof out.bytes, member, &message.body);
  }
  return at == nullptr ? 0 : static_cast<size_t>(at - out.bytes);
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
