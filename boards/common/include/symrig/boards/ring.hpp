// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
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

}  // namespace symrig::board_common
