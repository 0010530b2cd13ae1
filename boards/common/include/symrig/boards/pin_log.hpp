// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/edge_engine.hpp"

#include <cstddef>
#include <cstdint>
#include <vector>

namespace symrig::board_common {

/// A queue of fixed length. It allocates only when it is made, because the player must not wait for memory.
template <class T>
class Ring {
 public:
  /// room: at least 1.
  explicit Ring(std::size_t room) : slots_(room) {}

  std::size_t size() const { return count_; }
  std::size_t room() const { return slots_.size() - count_; }
  bool empty() const { return count_ == 0; }
  const T& front() const { return slots_[first_]; }
  /// Element k from the front, k < size().
  T& operator[](std::size_t k) { return slots_[(first_ + k) % slots_.size()]; }

  /// false: the queue is full.
  bool push(const T& value) {
    if (room() == 0) return false;
    slots_[(first_ + count_++) % slots_.size()] = value;
    return true;
  }
  /// false: the queue is empty.
  bool pop(T& value) {
    if (empty()) return false;
    value = front();
    first_ = (first_ + 1) % slots_.size();
    --count_;
    return true;
  }
  void clear() { count_ = 0; }

 private:
  std::vector<T> slots_;
  std::size_t first_ = 0;
  std::size_t count_ = 0;
};

/// Keeps edges of outputs and inputs in order of time until the firmware takes them. Output edges are known
/// at once, input edges possibly later. So an edge is given out only when no older one can still arrive.
class PinLog {
 public:
  /// hold: longest time in ticks from an input's edge until it is known. one_source: input edges arrive in
  /// order of time, so no edge older than the last one can still arrive.
  PinLog(std::size_t room, hal::Tick hold, bool one_source)
      : edges_(room), hold_(hold), one_source_(one_source) {}

  void watch(std::uint32_t lines) { watched_ = lines; }
  /// Inserts the edge by its time. A full log drops it and counts an overflow.
  void add(const hal::CapturedEdge& edge);
  void add_input(const hal::CapturedEdge& edge);
  /// Adds an edge to its level in `levels` for each line in `changed`, lowest line first.
  void add_changes(std::uint32_t changed, std::uint32_t levels, hal::Tick tick);
  /// Edges were lost elsewhere.
  void lose() { overflow_ = true; }
  /// Takes the oldest edge if it is old enough at `now`.
  bool pop(hal::CapturedEdge& edge, hal::Tick now);
  bool take_overflow();
  /// The time from which pop() returns an edge; kNever if the log is empty.
  hal::Tick ready_at() const;

 private:
  Ring<hal::CapturedEdge> edges_;
  hal::Tick hold_;
  bool one_source_;
  hal::Tick settled_ = 0;  // no older edge can still arrive
  std::uint32_t watched_ = UINT32_MAX;
  bool overflow_ = false;
};

}  // namespace symrig::board_common
