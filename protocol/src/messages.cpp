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
