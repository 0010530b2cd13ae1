// SPDX-License-Identifier: Apache-2.0
#pragma once

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

}  // namespace symrig::firmware
