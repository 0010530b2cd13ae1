// SPDX-License-Identifier: Apache-2.0

#include "symrig/base/progress.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string>
#include <thread>
#include <utility>

namespace symrig {

struct Work::State {
  explicit State(Progress given) : progress(std::move(given)) {}

  /// A callback that computes may come back here: its thread takes tasks of ours while it waits.
  bool call() {
    if (stop.load(std::memory_order_relaxed)) return false;
    if (calling) return true;
    calling = true;
    ProgressEvent event = last;
    event.stage = stage;
    told = operations.load(std::memory_order_relaxed);
    event.steps = {told / kStep, expected > 0 ? std::max(expected, told) / kStep : 0};
    const bool go_on = progress(event);
    if (!go_on) stop.store(true, std::memory_order_relaxed);
    calling = false;
    return go_on;
  }
  bool by_owner() const { return std::this_thread::get_id() == owner; }
  void start(std::string_view name, std::int64_t wanted) {
    stage = name;
    expected = wanted;
    operations.store(0, std::memory_order_relaxed);
    told = 0;
  }

  const Progress progress;
  const std::thread::id owner = std::this_thread::get_id();
  std::atomic<std::int64_t> operations{0};  ///< of the stage
  std::atomic<bool> stop{false};
  // Only the owner uses these.
  std::string stage;
  ProgressEvent last;  ///< its photographs
  std::int64_t expected = 0, told = 0;
  bool calling = false;
};

Work::Work(Progress progress) {
  if (progress) state_ = std::make_shared<State>(std::move(progress));
}

bool Work::tell(ProgressEvent event) const {
  if (!state_) return true;
  if (event.stage != state_->stage) state_->start(event.stage, 0);
  state_->last = event;
  return state_->call();
}

void Work::begin(std::string_view stage, std::int64_t operations, std::optional<std::int64_t> taken) const {
  if (!state_) return;
  state_->start(stage, operations);
  const std::int64_t done = taken.value_or(state_->last.done);
  state_->last = {.stage = {}, .done = done, .expected = done, .later = kNoneToCome, .computing = true};
  if (!state_->call()) throw Stopped{};
}

void Work::add(std::int64_t operations) const {
  if (!state_) return;
  const std::int64_t done = operations + state_->operations.fetch_add(operations, std::memory_order_relaxed);
  if (state_->by_owner() && done - state_->told >= kStep) look();
  if (stopped()) throw Stopped{};
}

void Work::look() const {
  if (state_ && !state_->call()) throw Stopped{};
}

bool Work::stopped() const {
  return state_ && state_->stop.load(std::memory_order_relaxed);
}

void Work::count(std::int64_t operations) const noexcept {
  if (state_) state_->operations.fetch_add(operations, std::memory_order_relaxed);
}

Error Work::stop_error() const {
  std::string what =
      "capture stopped after " + std::to_string(state_ ? state_->last.done : 0) + " photographs";
  if (state_ && state_->last.computing) what += ", while it computed (" + state_->stage + ")";
  return {ErrorCode::interrupted, std::move(what), "run it again"};
}

namespace {

constexpr double kShortest = 0.3;  // s; before this, the start-up dominates the measurement
constexpr double kWindow =
    0.5;  // of the elapsed time; so photographs that came from a log soon stop counting
constexpr double kClose = 1e-3;  // of the elapsed time; moments that are closer are one
constexpr double kRoom =
    3;  // largest ratio of the bounds: the mean is then wrong by less than a factor of two
constexpr double kFinishing = 0.3;  // of the elapsed time; upper bound for the work after the last unit
constexpr double kSlower =
    1.5;  // later units take at most this much longer, because the known transport grows

}  // namespace

void TimeToGo::report(const ProgressEvent& event, double seconds) {
  const std::int64_t done = event.computing ? event.steps.done : event.done;
  const std::int64_t expected = event.computing ? event.steps.expected : event.expected;
  // The count of another job, or of another kind.
  if (event.computing != computing_ || (!moments_.empty() && done < moments_.back().done)) moments_.clear();
  computing_ = event.computing;
  const bool soon = moments_.size() > 2 && seconds - moments_[moments_.size() - 2].seconds < kClose * seconds;
  if (soon) moments_.pop_back();
  moments_.push_back({seconds, done});
  // The first moment that stays begins the window.
  while (moments_.size() > 2 && moments_[1].seconds <= seconds * (1 - kWindow)) moments_.pop_front();
  left_ = std::max<std::int64_t>(0, expected - done);
  later_ = expected > 0 ? event.later : UnitsToCome{};
}

/// Seconds for each unit.
std::optional<double> TimeToGo::pace() const {
  if (moments_.size() < 2 || moments_.back().seconds < kShortest) return std::nullopt;
  const auto done = static_cast<double>(moments_.back().done - moments_.front().done);
  const double took = moments_.back().seconds - moments_.front().seconds;
  if (!(done > 0) || !(took > 0)) return std::nullopt;
  return took / done;
}

std::optional<double> TimeToGo::seconds() const {
  const auto each = pace();
  if (!each || !later_.known()) return std::nullopt;
  const double least = *each * static_cast<double>(left_ + later_.least);
  const double most =
      kSlower * *each * static_cast<double>(left_ + later_.most) + kFinishing * moments_.back().seconds;
  if (!(least > 0) || most > kRoom * least) return std::nullopt;
  return std::sqrt(least * most);
}

}  // namespace symrig
