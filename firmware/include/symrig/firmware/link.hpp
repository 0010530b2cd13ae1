// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/clock.hpp"
#include "symrig/hal/peripherals.hpp"
#include "symrig/protocol/frame.hpp"
#include "symrig/protocol/messages.hpp"

namespace symrig::firmware {

/// Events for the host, with 16-bit numbers. They are kept until the host acknowledges them.
///
///   acked <= sent <= ever_sent <= head in the circle of sequence numbers; slots hold [acked, head).
///
/// Without room, the newest event is only counted as lost. The last four slots are reserved for events about
/// the end of a run.
class EventQueue {
 public:
  static constexpr uint16_t kReserve = 4;

  /// slots: memory for `capacity` events (a power of two, 8 to 16384), owned by the caller.
  EventQueue(symrig_wire_Event* slots, uint16_t capacity) : slots_(slots), capacity_(capacity) {}

  /// Adds a mark or an edge. It is lost if there is no room.
  void push(const symrig_wire_Event& event, uint64_t tick) { add(event, tick, capacity_ - kReserve); }
  /// Adds the start or end of a run, or a fault. It may use the reserved slots.
  void push_important(const symrig_wire_Event& event, uint64_t tick) { add(event, tick, capacity_); }

  uint16_t capacity() const { return capacity_; }
  bool has_unsent() const { return sent_ != head_; }
  uint16_t in_flight() const { return static_cast<uint16_t>(sent_ - acked_); }
  uint16_t next_to_send() const { return sent_; }
  /// Call it only if has_unsent().
  const symrig_wire_Event& unsent() const { return slots_[sent_ % capacity_]; }
  void mark_sent() {
    if (sent_++ == ever_sent_) ++ever_sent_;
  }

  /// The host expects `next`, so everything before it has arrived. Ignores numbers that were never sent.
  /// Returns true if this freed a slot.
  bool acknowledge(uint16_t next) {
    const auto freed = static_cast<uint16_t>(next - acked_);
    if (freed == 0 || freed > static_cast<uint16_t>(ever_sent_ - acked_)) return false;
    if (in_flight() < freed) sent_ = next;
    acked_ = next;
    tell_lost(capacity_ - kReserve);
    return true;
  }
  /// Sends all events again that are not acknowledged.
  void rewind() { sent_ = acked_; }

  /// Events lost since the last call of restart_count().
  uint32_t lost() const { return lost_in_run_; }
  void restart_count() { lost_in_run_ = 0; }

 private:
  uint16_t used() const { return static_cast<uint16_t>(head_ - acked_); }

  void add(const symrig_wire_Event& event, uint64_t tick, unsigned limit) {
    tell_lost(limit - 1);
    if (used() < limit) {
      slots_[head_++ % capacity_] = event;
      return;
    }
    if (untold_ == 0) first_lost_ = tick;
    ++untold_;
    ++lost_in_run_;
  }

  /// Adds EventsLost at the place of the lost events, if there is room.
  void tell_lost(unsigned limit) {
    if (untold_ == 0 || used() >= limit) return;
    symrig_wire_Event& event = slots_[head_++ % capacity_];
    __builtin_memset(&event, 0, sizeof event);
    event.which_body = symrig_wire_Event_events_lost_tag;
    event.body.events_lost = {untold_, first_lost_};
    untold_ = 0;
  }

  symrig_wire_Event* slots_;
  uint16_t capacity_;
  uint16_t acked_ = 0;
  uint16_t sent_ = 0;
  uint16_t ever_sent_ = 0;
  uint16_t head_ = 0;
  uint32_t untold_ = 0;
  uint32_t lost_in_run_ = 0;
  uint64_t first_lost_ = 0;
};

/// Finds an urgent abort in the bytes from the host before the core handles them. It runs in the interrupt in
/// which the bytes arrive, so that outputs are safe even if the main loop is busy. The core handles the same
/// bytes later.
///
/// It is fast enough for an interrupt: an abort is one short frame of a known size, so it stores no longer
/// frames. It computes the CRC byte by byte, and only of frames that may be an abort. All at once would take
/// a Mega 100 us, in which it cannot see an interlock.
class UrgentScan {
 public:
  /// true: this byte completes a valid urgent abort.
  bool push(uint8_t byte) {
    if (byte == 0) return finish();
    if (left_ == 0) {
      // A new block of COBS: the block before it represents a zero at its end, unless it was a full block.
      if (zero_owed_) store(0);
      zero_owed_ = byte != 0xFF;
      left_ = static_cast<uint8_t>(byte - 1);
      return false;
    }
    --left_;
    store(byte);
    return false;
  }
  /// The host disconnected: discards a partial frame.
  void restart() {
    size_ = 0;
    left_ = 0;
    zero_owed_ = false;
    crc_ = {};
  }

 private:
  static constexpr size_t kKindAt = 1;
  static constexpr size_t kBody = 2;
  static constexpr size_t kCovered = protocol::kHeaderSize + kBody;
  static constexpr size_t kSize = kCovered + protocol::kCrcSize;

  void store(uint8_t byte) {
    if (size_ < kSize) plain_[size_] = byte;
    if (size_ < kCovered && (size_ < kKindAt || is_request())) crc_.add(byte);
    if (size_ <= kSize) ++size_;
  }

  bool finish() {
    const bool found =
        size_ == kSize && left_ == 0 && is_abort() && crc_.value() == protocol::get_u32(plain_ + kCovered);
    restart();
    return found;
  }

  bool is_request() const { return plain_[kKindAt] == static_cast<uint8_t>(protocol::Kind::request); }

  /// Request{abort{}} in the form that every encoder writes: field 10, length-delimited, empty.
  bool is_abort() const {
    const uint8_t flags = plain_[7];
    const bool urgent = (flags & protocol::flag::urgent) != 0;
    const bool sync = (flags & protocol::flag::sync) != 0;
    const uint8_t* body = plain_ + protocol::kHeaderSize;
    return is_request() && urgent && !sync && body[0] == (10U << 3U | 2U) && body[1] == 0;
  }

  uint8_t plain_[kSize] = {};
  size_t size_ = 0;         // kSize + 1: too long
  protocol::Crc32c crc_;    // of what is covered, so far
  uint8_t left_ = 0;        // bytes that are missing in this block
  bool zero_owed_ = false;  // the last block represents a zero at its end, if another block follows
};

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
