// SPDX-License-Identifier: Apache-2.0
#include "board/links/wire.hpp"

#include "symrig/protocol/messages.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace symrig::board {
namespace {

using protocol::ByteView;
using protocol::Frame;
using protocol::FrameDecoder;
using protocol::Kind;
namespace flag = protocol::flag;

constexpr std::uint8_t kCredit = 64;  // events the board may have in flight

Error no_answer(int attempts) {
  return {ErrorCode::device_lost, "the board does not answer (asked " + std::to_string(attempts) + " times)",
          "check its power and cable, then connect again"};
}

Error restarted() {
  return {ErrorCode::device_lost,
          "the board does not know this session: it was restarted, or another host connected to it",
          "connect again"};
}

}  // namespace

/// A program during its upload: frames [first, next) were sent, and those before `base` have arrived.
struct Wire::Upload {
  std::uint32_t program_id;
  std::span<const std::uint8_t> bytes;
  Limits limits;
  std::uint16_t first;
  std::size_t base = 0;
  std::size_t next = 0;

  std::size_t chunk() const { return protocol::chunk_room(limits.mtu); }
  std::size_t chunks() const { return (bytes.size() + chunk() - 1) / chunk(); }
  std::uint16_t seq(std::size_t chunk) const { return static_cast<std::uint16_t>(first + chunk); }
};

Wire::Wire(std::unique_ptr<Link> link, const BoardOptions& options, EventSink sink)
    : link_(std::move(link)), options_(options), sink_(std::move(sink)) {}

Result<symrig_wire_Reply> Wire::hello() {
  symrig_wire_Request request = symrig_wire_Request_init_zero;
  request.which_body = symrig_wire_Request_hello_tag;
  request.body.hello = {protocol::kProtoMajor, protocol::kProtoMinor};
  in_session_ = false;
  // Ends a frame that the last host may have left incomplete.
  constexpr std::array<std::uint8_t, 1> kFlush{0};
  SYMRIG_CHECK(link_->send(kFlush));
  hello_ack_ = static_cast<std::uint16_t>(next_seq_ + 1);
  const std::uint16_t seq = next_seq_++;
  if (!std::exchange(asked_, true) && link_->restart_time().count() > 0) {
    auto first = ask(request, seq, flag::sync, 1);
    if (first || first.error().code != ErrorCode::device_lost) return first;
    SYMRIG_CHECK(await([this] { return in_session_; }, link_->restart_time()));
  }
  return ask(request, seq, flag::sync, options_.attempts);
}

Result<symrig_wire_Reply> Wire::request(const symrig_wire_Request& request) {
  return ask(request, next_seq_++, 0, options_.attempts);
}

Result<symrig_wire_Reply> Wire::urgent(const symrig_wire_Request& request) {
  // A number that normal requests do not use now: half the number range away from the next one.
  return ask(request, static_cast<std::uint16_t>(next_seq_ + 0x8000U), flag::urgent, options_.attempts);
}

Result<symrig_wire_Reply> Wire::ask(const symrig_wire_Request& request, std::uint16_t seq, std::uint8_t flags,
                                    int attempts) {
  protocol::BodyBuffer body;
  const std::size_t size = encode(request, body);
  const bool urgent = flags == flag::urgent;
  const auto wanted = static_cast<std::uint16_t>(urgent ? seq : seq + 1);
  const auto answered = [&] { return reply_ && reply_ack_ == wanted && reply_urgent_ == urgent; };
  bool stranger = false;
  for (int attempt = 0; attempt < attempts; ++attempt) {
    reply_.reset();
    nak_ = false;
    SYMRIG_CHECK(send(Kind::request, seq, flags, {body.bytes, size}));
    SYMRIG_CHECK(await([&] { return answered() || nak_; }, options_.reply_timeout));
    if (answered()) return *reply_;
    stranger = stranger || (nak_ && nak_ack_ != seq);
  }
  return stranger ? restarted() : no_answer(attempts);
}

Result<std::optional<symrig_wire_Reply>> Wire::send_chunks(std::uint32_t program_id,
                                                           std::span<const std::uint8_t> bytes,
                                                           const Limits& limits) {
  Upload upload{program_id, bytes, {limits.mtu, std::max(limits.window, 1U)}, next_seq_};
  next_seq_ = upload.seq(upload.chunks());
  acked_ = upload.first;
  int silent = 0;
  while (upload.base < upload.chunks()) {
    if (silent == options_.attempts) return no_answer(silent);
    reply_.reset();
    nak_ = false;
    SYMRIG_CHECK(send_window(upload));
    SYMRIG_CHECK(
        await([&] { return nak_ || reply_ || acked_ != upload.seq(upload.base); }, options_.reply_timeout));
    const auto arrived = static_cast<std::uint16_t>(acked_ - upload.seq(upload.base));
    const bool progress = arrived > 0 && arrived <= upload.next - upload.base;
    if (reply_ && progress && protocol::raw(reply_->code) != symrig_wire_Code_CODE_OK)
      return std::optional(*reply_);
    silent = progress ? 0 : silent + 1;
    if (progress) upload.base += arrived;
    if (!progress || nak_)
      upload.next = upload.base;  // go back and repeat every frame that is not acknowledged
  }
  return std::optional<symrig_wire_Reply>();
}

Result<void> Wire::send_window(Upload& upload) {
  for (; upload.next < upload.chunks() && upload.next - upload.base < upload.limits.window; ++upload.next) {
    const std::size_t offset = upload.next * upload.chunk();
    const std::size_t count = std::min(upload.chunk(), upload.bytes.size() - offset);
    std::array<std::uint8_t, protocol::kMaxBody> body{};
    const std::size_t size = protocol::encode_chunk(
        {upload.program_id, static_cast<std::uint32_t>(offset), {upload.bytes.data() + offset, count}},
        {body.data(), body.size()});
    SYMRIG_CHECK(send(Kind::data, upload.seq(upload.next), 0, {body.data(), size}));
  }
  return {};
}

Result<void> Wire::send(Kind kind, std::uint16_t seq, std::uint8_t flags, ByteView body) {
  std::array<std::uint8_t, protocol::kMaxWire> wire;
  const protocol::FrameHeader header{protocol::kProtoMajor, kind, seq, next_event_, kCredit, flags};
  const std::size_t size = protocol::encode_frame(header, body, {wire.data(), wire.size()});
  return link_->send(std::span(wire).first(size));
}

Result<void> Wire::listen(Nanoseconds timeout) {
  SYMRIG_TRY(const auto bytes, link_->receive(timeout));
  for (const std::uint8_t byte : bytes)
    if (decoder_.push(byte) == FrameDecoder::Event::frame) take(decoder_.frame());
  const Kind answer = events_missing_ ? Kind::nak : Kind::ack;
  if (!std::exchange(events_to_acknowledge_, false) && !events_missing_) return {};
  events_missing_ = false;
  return send(answer, next_seq_, 0, {});
}

Result<void> Wire::await(const std::function<bool()>& arrived, Nanoseconds timeout) {
  const Nanoseconds deadline = now() + timeout;
  while (!arrived()) {
    const Nanoseconds left = deadline - now();
    if (left.count() <= 0) return {};
    SYMRIG_CHECK(listen(left));
  }
  return {};
}

void Wire::take(const Frame& frame) {
  switch (frame.header.kind) {
    case Kind::reply:
      return take_reply(frame);
    case Kind::event:
      return take_event(frame);
    case Kind::nak:
      nak_ = true;
      nak_ack_ = frame.header.ack;
      acked_ = frame.header.ack;
      return;
    case Kind::ack:
      acked_ = frame.header.ack;
      break;
    case Kind::request:
    case Kind::data:
      return;  // only hosts send these
  }
  if (in_session_ && protocol::seq_before(next_event_, frame.header.seq)) events_missing_ = true;
}

void Wire::take_reply(const Frame& frame) {
  symrig_wire_Reply reply;
  if (!decode(frame.body, reply)) return;
  reply_ = reply;
  reply_ack_ = frame.header.ack;
  reply_urgent_ = (frame.header.flags & flag::urgent) != 0;
  if (!reply_urgent_) acked_ = frame.header.ack;
  if (in_session_) {
    events_missing_ = events_missing_ || protocol::seq_before(next_event_, frame.header.seq);
  } else if (reply_ack_ == hello_ack_ && !reply_urgent_) {
    in_session_ = true;  // the reply to Hello contains the number of the board's next event
    next_event_ = frame.header.seq;
  }
}

void Wire::take_event(const Frame& frame) {
  if (!in_session_) return;
  if (frame.header.seq != next_event_) {
    events_missing_ = events_missing_ || protocol::seq_before(next_event_, frame.header.seq);
    events_to_acknowledge_ = true;  // a repeated event: the board did not receive the acknowledgement
    return;
  }
  ++next_event_;
  events_to_acknowledge_ = true;
  symrig_wire_Event event;
  if (decode(frame.body, event)) sink_(event);
}

}  // namespace symrig::board
