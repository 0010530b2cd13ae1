// SPDX-License-Identifier: Apache-2.0
#include "rig/steady_clock.hpp"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace symrig {
namespace {

constexpr int kBurst = 8;
constexpr Nanoseconds kKeptEvery{8'000'000'000};  // a quarter of the time span of a ClockModel
constexpr std::size_t kMostKept = 450;            // one hour; 2 KB each

Error not_read() {
  return {ErrorCode::bad_argument, "the board's clock has not been read yet", "read it first"};
}

}  // namespace

Result<void> SteadyClock::begin(Board& board) {
  model_.emplace(board.info().rate);
  past_.clear();
  opened_ = board.opened();
  for (int k = 0; k < kBurst; ++k) SYMRIG_CHECK(ask(board));
  return {};
}

Result<void> SteadyClock::ask(Board& board) {
  SYMRIG_TRY(const TimeReading reading, board.time());
  const auto added = model_->add(reading);
  if (!added)
    return Error{ErrorCode::device_lost, "the board's clock jumped: " + added.error().what,
                 "check the board's power"};
  keep(reading);
  return {};
}

void SteadyClock::keep(const TimeReading& reading) {
  if (!past_.empty() && reading.received - past_.back().received < kKeptEvery) return;
  past_.push_back({reading.taken, reading.received, *model_});
  if (past_.size() > kMostKept) past_.pop_front();
}

/// The oldest model with readings on both sides of the moment, because it reaches furthest beyond the moment.
const ClockModel& SteadyClock::model_for(BoardTime moment) const {
  const auto found = std::ranges::find_if(past_, [&](const Past& past) {
    return static_cast<std::int64_t>((past.taken - moment).count) > 0;  // the tick count wraps at 2^64
  });
  return found == past_.end() ? *model_ : found->model;
}

Result<SteadyMoment> SteadyClock::at(Ticks ticks) const {
  if (!model_) return not_read();
  const BoardTime moment{ticks};
  SYMRIG_TRY(const HostEstimate host, model_for(moment).host_at(moment));
  return SteadyMoment{opened_ + host.at.since, host.bound};
}

Result<Ticks> SteadyClock::ticks_at(SteadyTime time) const {
  if (!model_) return not_read();
  SYMRIG_TRY(const BoardEstimate board, model_->board_at(HostTime{time - opened_}));
  return board.at.since;
}

}  // namespace symrig
