// SPDX-License-Identifier: Apache-2.0
#include "edge_log.hpp"

namespace symrig::mega2560 {

bool EdgeLog::pop(hal::CapturedEdge& edge) {
  Slot slot{};
  {
    const IrqLock lock;
    if (put_ == taken_) return false;
    slot = slots_[taken_ % kRoom];
    taken_ = static_cast<uint8_t>(taken_ + 1);
  }
  edge = {clock_.extend(slot.tick), static_cast<uint8_t>(slot.line & ~kHigh), (slot.line & kHigh) != 0};
  return true;
}

bool EdgeLog::take_overflow() {
  const IrqLock lock;
  const bool lost = overflow_;
  overflow_ = false;
  return lost;
}

uint32_t EdgeLog::take_chatter() {
  const IrqLock lock;
  return uint32_t{gate_.take_closed()} << kOutputs;
}

void EdgeLog::watch(uint32_t lines) {
  const IrqLock lock;
  watched_ = static_cast<uint16_t>(lines);
}

}  // namespace symrig::mega2560
