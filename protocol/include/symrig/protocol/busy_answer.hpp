// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/messages.hpp"

namespace symrig::protocol {

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
