// SPDX-License-Identifier: Apache-2.0
#include "busy_answer.hpp"

#include "symrig/protocol/messages.hpp"

namespace symrig::board_linux {
namespace {

using protocol::Kind;

std::vector<std::uint8_t> answer_to(const protocol::FrameHeader& request) {
  symrig_wire_Reply reply = symrig_wire_Reply_init_zero;
  reply.code = symrig_wire_Code_CODE_BUSY;
  protocol::BodyBuffer body{};
  const std::size_t size = encode(reply, body);
  const auto urgent = static_cast<std::uint8_t>(request.flags & protocol::flag::urgent);
  // The number of an urgent request is a token, which the answer returns unchanged.
  const auto ack = static_cast<std::uint16_t>(urgent != 0 ? request.seq : request.seq + 1);
  std::vector<std::uint8_t> wire(protocol::kMaxWire);
  wire.resize(protocol::encode_frame({protocol::kProtoMajor, Kind::reply, 0, ack, 0, urgent},
                                     {body.bytes, size}, {wire.data(), wire.size()}));
  return wire;
}

}  // namespace

std::vector<std::uint8_t> BusyAnswer::take(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) {
    if (decoder_.push(byte) != protocol::FrameDecoder::Event::frame) continue;
    if (decoder_.frame().header.kind == Kind::request) return answer_to(decoder_.frame().header);
  }
  return {};
}

}  // namespace symrig::board_linux
