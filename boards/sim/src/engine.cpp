// SPDX-License-Identifier: Apache-2.0
#include "engine.hpp"

#include <algorithm>

namespace symrig::boards {

void Engine::push(const hal::Segment& segment) {
  queue_[(first_ + count_) % queue_.size()] = segment;
  ++count_;
  closed_ = false;
}

hal::Tick Engine::start(hal::Tick tick) {
  playing_ = true;
  underrun_ = false;
  played_ = 0;
  next_ = std::max(tick, pins_.now());
  const hal::Tick begin = next_;
  if (begin == pins_.now()) step();
  return begin;
}

void Engine::step() {
  if (count_ == 0) {
    playing_ = false;
    underrun_ = !closed_;
    return;
  }
  const hal::Segment segment = queue_[first_];
  first_ = (first_ + 1) % queue_.size();
  --count_;
  ++played_;
  next_ += segment.ticks;
  drive(segment.levels);
}

void Engine::force(std::uint32_t levels) {
  playing_ = false;
  underrun_ = false;
  closed_ = false;
  count_ = 0;
  drive(levels);
}

void Engine::drive(std::uint32_t levels) {
  levels_ = levels;
  pins_.drive(levels);
}

}  // namespace symrig::boards
