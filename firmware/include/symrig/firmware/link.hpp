// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/firmware/event_queue.hpp"
#include "symrig/hal/byte_link.hpp"
#include "symrig/hal/types.hpp"
#include "symrig/protocol/data_chunk.hpp"
#include "symrig/protocol/messages.hpp"

namespace symrig::firmware {

/// When a request is answered.
enum class Answer : uint8_t {
  now,   ///< the reply is complete
  later  ///< Link::complete() will bring it
};

/// Whoever carries out what the host asks for.
class Requests {
 public:
  /// Carries out a request and fills in the reply (which comes empty: code OK).
  virtual Answer answer(const symrig_wire_Request& request, symrig_wire_Reply& reply) = 0;
  /// Takes a program chunk. code OK in the reply: it is acknowledged without a reply.
  virtual void take_chunk(const protocol::DataChunk& chunk, symrig_wire_Reply& reply) = 0;

 protected:
  ~Requests() = default;
};

/// The board's end of the wire: frames, sequence numbers, replies kept for repeated requests, events sent
/// until they are acknowledged. Rules: protocol/PROTOCOL.md, "Sequence". Whatever bytes come, memory stays
/// bounded and only sound, well-ordered frames reach Requests.
class Link {
 public:
  static constexpr uint8_t kWindow = 8;  ///< DATA frames the host may have in flight

  Link(hal::ByteLink& bytes, EventQueue& events, uint64_t tick_hz)
      : bytes_(bytes), events_(events), resend_after_(tick_hz / 20) {}

  /// Takes at most kBytesPerPoll bytes from the host.
  void receive(Requests& requests, hal::Tick now);
  /// The reply to the request that was to be answered later. Nothing happens if the host has begun a new
  /// session meanwhile.
  void complete(const symrig_wire_Reply& reply);
  /// Sends events as far as the host's credit and the link's room go, at most kEventsPerPoll.
  void send_events(hal::Tick now);

  /// When unacknowledged events are sent again.
  hal::Tick next_deadline() const;
  /// Bytes may be waiting that one receive() did not take.
  bool hungry() const { return hungry_ || unsent_; }
  uint32_t bad_frames() const { return bad_frames_; }

 private:
  // What one poll does at most: both count towards poll_ticks of the board (hal/board.hpp).
  static constexpr size_t kBytesPerPoll = 128;
  static constexpr unsigned kEventsPerPoll = 2;

  void take(const protocol::Frame& frame, Requests& requests);
  void take_request(const protocol::Frame& frame, Requests& requests);
  void take_sync(const protocol::Frame& frame, Requests& requests);
  void take_urgent(const protocol::Frame& frame, Requests& requests);
  void take_data(const protocol::Frame& frame, Requests& requests);
  /// true: the frame is the one expected; it has been counted. Else it has been dealt with.
  bool in_turn(uint16_t seq);
  void keep_reply(uint16_t seq, const symrig_wire_Reply& reply);
  void send_kept_reply();
  void send(protocol::Kind kind, uint16_t ack, uint8_t flags, protocol::ByteView body);
  bool send_event();

  hal::ByteLink& bytes_;
  EventQueue& events_;
  uint64_t resend_after_;
  protocol::FrameDecoder decoder_;

  bool session_ = false;
  bool hungry_ = false;
  bool unsent_ = false;     // events could be sent that one poll did not send
  bool pending_ = false;    // the request before expected_ will be answered later
  uint16_t expected_ = 0;   // number of the host's next frame
  uint8_t credit_ = 0;      // events the host is ready to take
  hal::Tick now_ = 0;       // of the poll that receives
  hal::Tick progress_ = 0;  // when an event was last sent afresh or acknowledged
  uint32_t bad_frames_ = 0;

  bool reply_kept_ = false;
  uint16_t reply_seq_ = 0;  // of the request it answers
  size_t reply_size_ = 0;
  protocol::BodyBuffer reply_{};
  // Scratch that would be large on a small board's stack; one frame is worked on at a time.
  symrig_wire_Request request_ = symrig_wire_Request_init_zero;
  symrig_wire_Reply answer_ = symrig_wire_Reply_init_zero;
  protocol::BodyBuffer body_{};
  uint8_t input_[64] = {};
  uint8_t wire_[protocol::kMaxWire] = {};
};

}  // namespace symrig::firmware
