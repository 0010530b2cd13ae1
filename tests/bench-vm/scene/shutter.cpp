// SPDX-License-Identifier: Apache-2.0
#include "bench-vm/scene/shutter.hpp"

namespace symrig::bench_vm {

Shutter::Move Shutter::trigger(bool level, Nanoseconds at, bool sees) {
  if (level == level_) return Move::none;
  level_ = level;
  triggers_ += level ? 1 : 0;
  if (level && !sees) {
    ++unseen_;
    return Move::none;
  }
  if (level && at < busy_until_) {
    ++missed_;
    return Move::none;
  }
  if (level) {
    open_ = true;
    return Move::open;
  }
  if (!open_) return Move::none;
  open_ = false;
  busy_until_ = at + readout_;
  return Move::close;
}

}  // namespace symrig::bench_vm
