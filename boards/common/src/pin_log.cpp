// SPDX-License-Identifier: Apache-2.0
#include "symrig/boards/pin_log.hpp"

#include <algorithm>
#include <bit>
#include <utility>

namespace symrig::board_common {

void PinLog::add(const hal::CapturedEdge& edge) {
  if ((watched_ >> edge.line & 1U) == 0) return;
  if (!edges_.push(edge)) {
    overflow_ = true;
    return;
  }
  for (std::size_t k = edges_.size() - 1; k > 0 && edges_[k].tick < edges_[k - 1].tick; --k)
    std::swap(edges_[k], edges_[k - 1]);
}

void PinLog::add_input(const hal::CapturedEdge& edge) {
  if (one_source_) settled_ = std::max(settled_, edge.tick);
  add(edge);
}

void PinLog::add_changes(std::uint32_t changed, std::uint32_t levels, hal::Tick tick) {
  for (; changed != 0; changed &= changed - 1) {
    const auto line = static_cast<std::uint8_t>(std::countr_zero(changed));
    add({tick, line, (levels >> line & 1U) != 0});
  }
}

hal::Tick PinLog::ready_at() const {
  if (edges_.empty()) return hal::kNever;
  const hal::Tick oldest = edges_.front().tick;
  return oldest <= settled_ ? oldest : oldest + hold_;
}

bool PinLog::pop(hal::CapturedEdge& edge, hal::Tick now) {
  return ready_at() <= now && edges_.pop(edge);
}

bool PinLog::take_overflow() {
  return std::exchange(overflow_, false);
}

}  // namespace symrig::board_common
