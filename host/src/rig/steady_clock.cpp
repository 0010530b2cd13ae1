// SPDX-License-Identifier: Apache-2.0
#include "rig/steady_clock.hpp"

#include <utility>

namespace symrig {
namespace {

constexpr int kBurst = 8;

}  // namespace

Result<void> SteadyClock::begin(device::Board& board) {
  model_.emplace(board.info().rate);
  opened_ = board.opened();
  for (int k = 0; k < kBurst; ++k) SYMRIG_CHECK(ask(board));
  return {};
}

Result<void> SteadyClock::ask(device::Board& board) {
  SYMRIG_TRY(const device::TimeReading reading, board.time());
  const auto added = model_->add(reading);
  if (added) return {};
  return Error{ErrorCode::device_lost, "the board's clock does not go on: " + added.error().what,
               "check the board's supply"};
}

Result<SteadyMoment> SteadyClock::at(device::Ticks ticks) const {
  if (!model_)
    return Error{ErrorCode::bad_argument, "the board's clock has not been read yet", "read it first"};
  SYMRIG_TRY(const device::HostEstimate host, model_->host_at({ticks}));
  return SteadyMoment{opened_ + host.at.since, host.bound};
}

}  // namespace symrig
