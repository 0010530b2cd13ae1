// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/messages.hpp"

namespace symrig::firmware {

/// Events on their way to the host, numbered by 16 bits, kept until the host has acknowledged them.
///
///   acked <= sent <= ever_sent <= head in the circle of sequence numbers; slots hold [acked, head).
///
/// If there is no room, the newest event is counted as lost instead; the last four slots are kept for events
/// that tell how a run ended.
class EventQueue {
 public:
  static constexpr uint16_t kReserve = 4;

  /// slots: memory for `capacity` events (a power of two, 8 to 16384), kept elsewhere.
  EventQueue(symrig_wire_Event* slots, uint16_t capacity) : slots_(slots), capacity_(capacity) {}

  /// A mark or an edge: lost if there is no room.
  void push(const symrig_wire_Event& event, uint64_t tick) { add(event, tick, capacity_ - kReserve); }
  /// How a run began or ended, a fault: may use the reserve.
  void push_important(const symrig_wire_Event& event, uint64_t tick) { add(event, tick, capacity_); }

  uint16_t capacity() const { return capacity_; }
  bool has_unsent() const { return sent_ != head_; }
  uint16_t in_flight() const { return static_cast<uint16_t>(sent_ - acked_); }
  uint16_t next_to_send() const { return sent_; }
  /// Only if has_unsent().
  const symrig_wire_Event& unsent() const { return slots_[sent_ % capacity_]; }
  void mark_sent() {
    if (sent_++ == ever_sent_) ++ever_sent_;
  }

  /// The host expects `next`: everything before it has arrived. Numbers never sent are ignored.
  /// Returns true if this freed something.
  bool acknowledge(uint16_t next) {
    const auto freed = static_cast<uint16_t>(next - acked_);
    if (freed == 0 || freed > static_cast<uint16_t>(ever_sent_ - acked_)) return false;
    if (in_flight() < freed) sent_ = next;
    acked_ = next;
    tell_lost(capacity_ - kReserve);
    return true;
  }
  /// Sends again all that is not acknowledged.
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

  /// Puts EventsLost where the lost ones would have stood, if there is room.
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

}  // namespace symrig::firmware
