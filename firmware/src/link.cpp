// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/link.hpp"

namespace symrig::firmware {

using hal::Tick;
using protocol::ByteView;
using protocol::Frame;
using protocol::FrameDecoder;
using protocol::Kind;
namespace flag = protocol::flag;

namespace {

/// Sets all fields to zero, like the schema's initialiser, but without a copy on the stack.
void blank(symrig_wire_Reply& reply) {
  __builtin_memset(&reply, 0, sizeof reply);
}

}  // namespace

void Link::receive(Requests& requests, Tick now) {
  now_ = now;
  if (!bytes_.attached()) decoder_.restart();
  size_t taken = 0;
  size_t got = sizeof input_;
  while (got == sizeof input_ && taken < kBytesPerPoll) {
    got = bytes_.read(input_, sizeof input_);
    taken += got;
    for (size_t i = 0; i < got; ++i) {
      const FrameDecoder::Event event = decoder_.push(input_[i]);
      if (event == FrameDecoder::Event::frame) {
        take(decoder_.frame(), requests);
      } else if (event != FrameDecoder::Event::none) {
        ++bad_frames_;
      }
    }
  }
  hungry_ = got == sizeof input_;
}

void Link::complete(const symrig_wire_Reply& reply) {
  if (!pending_) return;
  pending_ = false;
  keep_reply(static_cast<uint16_t>(expected_ - 1), reply);
  send_kept_reply();
}

void Link::take(const Frame& frame, Requests& requests) {
  const bool sync = frame.header.kind == Kind::request && (frame.header.flags & flag::sync) != 0;
  const bool urgent = frame.header.kind == Kind::request && (frame.header.flags & flag::urgent) != 0;
  if (sync) return take_sync(frame, requests);
  if (urgent) return take_urgent(frame, requests);
  if (!session_) return send(Kind::nak, expected_, 0, {});
  credit_ = frame.header.credit;
  if (events_.acknowledge(frame.header.ack)) progress_ = now_;
  switch (frame.header.kind) {
    case Kind::request:
      return take_request(frame, requests);
    case Kind::data:
      return take_data(frame, requests);
    case Kind::nak:
      events_.rewind();
      return;
    case Kind::ack:
      return;
    case Kind::reply:
    case Kind::event:
      ++bad_frames_;
      return;  // only boards send these
  }
}

/// Only Hello may begin a session. The board answers it for any version of the host.
void Link::take_sync(const Frame& frame, Requests& requests) {
  const bool hello = decode(frame.body, request_) && request_.which_body == symrig_wire_Request_hello_tag;
  if (!hello) {
    ++bad_frames_;
    return;
  }
  session_ = true;
  pending_ = false;
  expected_ = static_cast<uint16_t>(frame.header.seq + 1);
  credit_ = frame.header.credit;
  events_.rewind();
  blank(answer_);
  requests.answer(request_, answer_);
  keep_reply(frame.header.seq, answer_);
  send_kept_reply();
}

/// Abort must work in any state of the sequence, and a time ping should not wait in a queue. A repetition of
/// either has the same effect.
void Link::take_urgent(const Frame& frame, Requests& requests) {
  blank(answer_);
  if (!decode(frame.body, request_)) {
    answer_.code = symrig_wire_Code_CODE_DECODE;
  } else if (request_.which_body != symrig_wire_Request_abort_tag &&
             request_.which_body != symrig_wire_Request_time_ping_tag) {
    answer_.code = symrig_wire_Code_CODE_NOT_URGENT;
  } else {
    requests.answer(request_, answer_);
  }
  const uint16_t token = frame.header.seq;
  const size_t size = encode(answer_, body_);
  send(Kind::reply, token, flag::urgent, {body_.bytes, size});
}

bool Link::in_turn(uint16_t seq) {
  // The host must wait for its answer. The board drops frames that arrive meanwhile, and requests them again
  // later.
  if (pending_) return false;
  if (seq == expected_) {
    ++expected_;
    return true;
  }
  if (reply_kept_ && seq == reply_seq_) {
    send_kept_reply();
  } else {
    // An older frame was acknowledged before. A later frame means that another one was lost.
    send(protocol::seq_before(seq, expected_) ? Kind::ack : Kind::nak, expected_, 0, {});
  }
  return false;
}

void Link::take_request(const Frame& frame, Requests& requests) {
  if (!in_turn(frame.header.seq)) return;
  blank(answer_);
  if (frame.header.proto_major != protocol::kProtoMajor) {
    answer_.code = symrig_wire_Code_CODE_VERSION;
  } else if (!decode(frame.body, request_)) {
    answer_.code = symrig_wire_Code_CODE_DECODE;
  } else if (requests.answer(request_, answer_) == Answer::later) {
    pending_ = true;
    reply_kept_ = false;
    return;
  }
  keep_reply(frame.header.seq, answer_);
  send_kept_reply();
}

void Link::take_data(const Frame& frame, Requests& requests) {
  if (!in_turn(frame.header.seq)) return;
  protocol::DataChunk chunk;
  blank(answer_);
  if (protocol::decode_chunk(frame.body, chunk)) {
    requests.take_chunk(chunk, answer_);
  } else {
    answer_.code = symrig_wire_Code_CODE_DECODE;
  }
  if (answer_.code == symrig_wire_Code_CODE_OK) return send(Kind::ack, expected_, 0, {});
  keep_reply(frame.header.seq, answer_);
  send_kept_reply();
}

void Link::keep_reply(uint16_t seq, const symrig_wire_Reply& reply) {
  reply_kept_ = true;
  reply_seq_ = seq;
  reply_size_ = encode(reply, reply_);
}

void Link::send_kept_reply() {
  send(Kind::reply, static_cast<uint16_t>(reply_seq_ + 1), 0, {reply_.bytes, reply_size_});
}

/// Does not send a frame if there is no room: the host will repeat its request.
void Link::send(Kind kind, uint16_t ack, uint8_t flags, ByteView body) {
  const protocol::FrameHeader header{
      protocol::kProtoMajor, kind, events_.next_to_send(), ack, kWindow, flags};
  const size_t size = protocol::encode_frame(header, body, {wire_, sizeof wire_});
  if (size <= bytes_.room()) bytes_.write(wire_, size);
}

void Link::send_events(Tick now) {
  unsent_ = false;
  if (!session_) return;
  if (events_.in_flight() > 0 && now - progress_ >= resend_after_) {
    events_.rewind();
    progress_ = now;
  }
  unsigned left = kEventsPerPoll;
  while (events_.has_unsent() && events_.in_flight() < credit_) {
    unsent_ = left == 0;
    if (left-- == 0) return;
    if (events_.in_flight() == 0) progress_ = now;
    if (!send_event()) return;
  }
}

namespace {

size_t encode_event(const symrig_wire_Event& event, protocol::BodyBuffer& out) {
  switch (event.which_body) {
    case symrig_wire_Event_step_mark_tag:
      return encode(event.body.step_mark, out);
    case symrig_wire_Event_edge_tag:
      return encode(event.body.edge, out);
    default:
      return encode(event, out);
  }
}

}  // namespace

bool Link::send_event() {
  const size_t body_size = encode_event(events_.unsent(), body_);
  const protocol::FrameHeader header{
      protocol::kProtoMajor, Kind::event, events_.next_to_send(), expected_, kWindow, 0};
  const size_t size = protocol::encode_frame(header, {body_.bytes, body_size}, {wire_, sizeof wire_});
  if (size > bytes_.room()) return false;
  bytes_.write(wire_, size);
  events_.mark_sent();
  return true;
}

Tick Link::next_deadline() const {
  if (!session_ || events_.in_flight() == 0) return hal::kNever;
  return progress_ + resend_after_;
}

}  // namespace symrig::firmware
