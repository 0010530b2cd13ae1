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
  later  ///< Link::complete() will send it
};

/// The interface that executes the host's requests.
class Requests {
 public:
  /// Executes a request and fills in the reply, which is empty before (code OK).
  virtual Answer answer(const symrig_wire_Request& request, symrig_wire_Reply& reply) = 0;
  /// Stores a program chunk. With code OK, the link sends an acknowledgement instead of the reply.
  virtual void take_chunk(const protocol::DataChunk& chunk, symrig_wire_Reply& reply) = 0;

 protected:
  ~Requests() = default;
};

/// The board's end of the wire: frames, sequence numbers, replies for repeated requests, and events that are
/// sent until they are acknowledged. Rules: protocol/PROTOCOL.md, "Sequence". With any input, memory stays
/// bounded, and only undamaged frames in order reach Requests.
class Link {
 public:
  static constexpr uint8_t kWindow = 8;  ///< DATA frames the host may have in flight

  Link(hal::ByteLink& bytes, EventQueue& events, uint64_t tick_hz)
      : bytes_(bytes), events_(events), resend_after_(tick_hz / 20) {}

  /// Handles at most kBytesPerPoll bytes from the host.
  void receive(Requests& requests, hal::Tick now);
  /// Sends the reply to a request that was answered with Answer::later. Does nothing if the host began a new
  /// session meanwhile.
  void complete(const symrig_wire_Reply& reply);
  /// Sends events within the host's credit and the link's room, at most kEventsPerPoll.
  void send_events(hal::Tick now);

  /// The tick at which unacknowledged events are sent again.
  hal::Tick next_deadline() const;
  /// True if more bytes may be waiting than one receive() handles, or if more events can be sent.
  bool hungry() const { return hungry_ || unsent_; }
  uint32_t bad_frames() const { return bad_frames_; }

 private:
  // The most that one poll handles. Both count towards poll_ticks of the board (hal/board.hpp).
  static constexpr size_t kBytesPerPoll = 128;
  static constexpr unsigned kEventsPerPoll = 2;

  void take(const protocol::Frame& frame, Requests& requests);
  void take_request(const protocol::Frame& frame, Requests& requests);
  void take_sync(const protocol::Frame& frame, Requests& requests);
  void take_urgent(const protocol::Frame& frame, Requests& requests);
  void take_data(const protocol::Frame& frame, Requests& requests);
  /// true: this is the expected frame, and its number is now used. false: this function has answered it.
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
  bool unsent_ = false;     // the last poll did not send all possible events
  bool pending_ = false;    // the request before expected_ has no answer yet
  uint16_t expected_ = 0;   // number of the host's next frame
  uint8_t credit_ = 0;      // events for which the host has room
  hal::Tick now_ = 0;       // tick of the receiving poll
  hal::Tick progress_ = 0;  // when an event was last sent for the first time or acknowledged
  uint32_t bad_frames_ = 0;

  bool reply_kept_ = false;
  uint16_t reply_seq_ = 0;  // number of the request it answers
  size_t reply_size_ = 0;
  protocol::BodyBuffer reply_{};
  // Scratch memory that is too large for a small board's stack. Only one frame is handled at a time.
  symrig_wire_Request request_ = symrig_wire_Request_init_zero;
  symrig_wire_Reply answer_ = symrig_wire_Reply_init_zero;
  protocol::BodyBuffer body_{};
  uint8_t input_[64] = {};
  uint8_t wire_[protocol::kMaxMessageWire] = {};
};

}  // namespace symrig::firmware
