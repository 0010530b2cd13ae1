// SPDX-License-Identifier: Apache-2.0
#include "conformance/raw_session.hpp"

#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <array>

namespace symrig::conformance {

using protocol::Kind;
namespace flag = protocol::flag;

symrig_wire_Request make_request(pb_size_t which) {
  symrig_wire_Request request = symrig_wire_Request_init_zero;
  request.which_body = which;
  if (which == symrig_wire_Request_start_tag) request.body.start = {symrig_wire_Start_now_tag, {true}};
  return request;
}

Bytes RawSession::bytes_of(const symrig_wire_Request& request) {
  protocol::BodyBuffer body{};
  const std::size_t size = encode(request, body);
  return {body.bytes, body.bytes + size};
}

Bytes RawSession::chunk_body(std::uint32_t id, std::uint32_t offset, std::span<const std::uint8_t> bytes) {
  Bytes body(protocol::kMaxBody);
  body.resize(protocol::encode_chunk({id, offset, {bytes.data(), bytes.size()}}, {body.data(), body.size()}));
  return body;
}

Bytes RawSession::frame(Kind kind, std::uint16_t number, std::uint8_t flags, const Bytes& body,
                        std::uint8_t major) const {
  Bytes wire(protocol::kMaxWire);
  wire.resize(protocol::encode_frame({major, kind, number, ack, credit, flags}, {body.data(), body.size()},
                                     {wire.data(), wire.size()}));
  return wire;
}

void RawSession::send_bytes(std::span<const std::uint8_t> bytes) {
  if (lost_) return;
  if (const auto sent = link_->send(bytes); !sent) lost_ = sent.error();
}

void RawSession::send(Kind kind, std::uint16_t number, std::uint8_t flags, const Bytes& body,
                      std::uint8_t major) {
  send_bytes(frame(kind, number, flags, body, major));
}

void RawSession::send_chunk(std::uint32_t id, std::uint32_t offset, std::span<const std::uint8_t> bytes) {
  send(Kind::data, seq++, 0, chunk_body(id, offset, bytes));
}

void RawSession::take(Nanoseconds timeout) {
  const auto bytes = link_->receive(timeout);
  if (!bytes) {
    lost_ = bytes.error();
    return;
  }
  for (const std::uint8_t byte : *bytes)
    if (decoder_.push(byte) == protocol::FrameDecoder::Event::frame) take_frame(decoder_.frame());
  if (!owes_ack_ || !acknowledges) return;
  owes_ack_ = false;
  send(Kind::ack, seq, 0, {});
}

void RawSession::take_frame(const protocol::Frame& frame) {
  frames_.push_back({frame.header, {frame.body.data, frame.body.data + frame.body.size}});
  if (greeting_ && frame.header.kind == Kind::reply && frame.header.ack == *greeting_) {
    ack = frame.header.seq;  // the number of the first event
    greeting_.reset();
  }
  if (frame.header.kind != Kind::event || greeting_) return;
  owes_ack_ = true;
  if (frame.header.seq != ack) return;
  if (acknowledges) ++ack;
  symrig_wire_Event event;
  if (protocol::decode(frame.body, event) && acknowledges) events_.push_back(event);
}

std::optional<symrig_wire_Reply> RawSession::await_reply(std::uint16_t wanted, std::uint8_t flags) {
  const auto answers = [&](const Received& frame) {
    return frame.header.kind == Kind::reply && frame.header.ack == wanted &&
           (frame.header.flags & flag::urgent) == flags;
  };
  const auto arrived = [&] { return std::any_of(frames_.rbegin(), frames_.rend(), answers); };
  if (!listen_until(arrived, kAnswerTime)) return std::nullopt;
  const Received& found = *std::find_if(frames_.rbegin(), frames_.rend(), answers);
  symrig_wire_Reply reply;
  if (!protocol::decode({found.body.data(), found.body.size()}, reply)) return std::nullopt;
  return reply;
}

std::optional<symrig_wire_Reply> RawSession::ask_bytes(const Bytes& body, std::uint8_t major) {
  frames_.clear();
  const std::uint16_t number = seq++;
  send(Kind::request, number, 0, body, major);
  return await_reply(static_cast<std::uint16_t>(number + 1), 0);
}

std::optional<symrig_wire_Reply> RawSession::ask_urgently(const symrig_wire_Request& request) {
  frames_.clear();
  const auto token = static_cast<std::uint16_t>(seq + 0x8000U);
  send(Kind::request, token, flag::urgent, bytes_of(request));
  return await_reply(token, flag::urgent);
}

std::optional<symrig_wire_Reply> RawSession::hello() {
  frames_.clear();
  send_bytes(std::array<std::uint8_t, 1>{0});  // ends an incomplete frame on the wire
  symrig_wire_Request request = make_request(symrig_wire_Request_hello_tag);
  request.body.hello = {protocol::kProtoMajor, protocol::kProtoMinor};
  const std::uint16_t number = seq++;
  greeting_ = static_cast<std::uint16_t>(number + 1);
  send(Kind::request, number, flag::sync, bytes_of(request));
  return await_reply(static_cast<std::uint16_t>(number + 1), 0);
}

std::uint32_t RawSession::code(const symrig_wire_Request& request) {
  const auto reply = ask(request);
  return reply ? protocol::raw(reply->code) : kNoCode;
}

std::size_t RawSession::count(Kind kind) const {
  return static_cast<std::size_t>(std::count_if(
      frames_.begin(), frames_.end(), [kind](const Received& frame) { return frame.header.kind == kind; }));
}

const Received* RawSession::last(Kind kind) const {
  const auto found = std::find_if(frames_.rbegin(), frames_.rend(),
                                  [kind](const Received& frame) { return frame.header.kind == kind; });
  return found == frames_.rend() ? nullptr : &*found;
}

const symrig_wire_Event* RawSession::last_event(pb_size_t which) const {
  const auto found = std::find_if(events_.rbegin(), events_.rend(), [which](const symrig_wire_Event& event) {
    return event.which_body == which;
  });
  return found == events_.rend() ? nullptr : &*found;
}

void RawSession::forget() {
  frames_.clear();
  events_.clear();
}

}  // namespace symrig::conformance
